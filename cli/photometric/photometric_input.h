// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "json_document.h"
#include "sheaf/io.h"

namespace sheaf {

/// How far poses are from those given, after the Sim(3) that brings them together; where none were
/// disturbed, nothing.
struct PoseErrors {
  double rotation_rad = 0, center = 0;  ///< mean over the images
};
PoseErrors pose_errors(const PhotometricFolder& folder);
Json pose_errors_json(const std::optional<PoseErrors>& before,
                      const std::optional<PoseErrors>& after);

}  // namespace sheaf
