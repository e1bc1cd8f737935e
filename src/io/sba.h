// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// The text files of SBA's demo, told by the numbers of their lines; # begins a comment:
///   cameras   [fu u0 v0 ar s [k1 k2 p1 p2 k3]]  q (w x y z)  t       cam_from_world
///   points    X Y Z  frames {frame x y}
///   calib     three rows of a calibration matrix, where cameras have none
/// Cameras look along +z with y down; fv is ar fu. The skew s must be 0.
struct SbaFiles {
  struct File {
    std::string name, text;
  };
  File cameras, points, calib;
};

/// The files of a folder, if it has such: one text of cameras and one of points, and one calib
/// where cameras need it. Errors: unreadable_input, where there are several.
Result<std::optional<SbaFiles>> load_sba(const std::filesystem::path& folder);

/// Errors: unreadable_input, as FILE:LINE: found this, expected that.
Result<Problem> parse_sba(const SbaFiles& files, std::vector<std::string>& notes);

}  // namespace sheaf
