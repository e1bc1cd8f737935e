// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json_document.h"
#include "sheaf/scene.h"

namespace sheaf {

Json noise_json(const NoiseOptions& options);

/// "rotations 0.01 rad, points 0.05; seed 1"
std::string noise_text(const NoiseOptions& options);

}  // namespace sheaf
