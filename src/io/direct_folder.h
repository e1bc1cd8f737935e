// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "sheaf/error.h"
#include "sheaf/io.h"

namespace sheaf {

/// The two text files of a folder as `read_photometric` expects it, from memory; `name` is what
/// messages call them.
///   poses   a line per image: time, cam_from_world translation, quaternion x y z w
///   points  a line per point: X Y Z, then 16 grey levels, dx in -2..1 outside, dy in -2..1 inside
Result<void> parse_direct_poses(std::string_view text, const std::string& name,
                                PhotometricFolder& folder);
Result<void> parse_direct_points(std::string_view text, const std::string& name,
                                 PhotometricFolder& folder);

}  // namespace sheaf
