// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "sheaf/camera.h"

namespace sheaf {

/// A lens by a model that COLMAP has a number for: itself; a RADIAL_K3 lens as FULL_OPENCV and a
/// UCM lens as EUCM, which see the same. None for other models of no number. BAL's are no lenses
/// here.
std::optional<Camera> colmap_lens(const Camera& camera);

}  // namespace sheaf
