// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/patch_comparison.h"
#include "sheaf/error.h"

namespace sheaf {

/// SVG files in a folder, which is made or replaced whole, other files in it kept:
/// worst-patches.svg and median-patches.svg (six points each, by their rms after), and
/// residuals-J.svg for every image J; pixels are PNG pictures in them. Returns their names. Errors:
/// ErrorCode::unwritable_output.
Result<std::vector<std::string>> write_pictures(const PatchComparison& comparison,
                                                const std::vector<GreyImage>& images,
                                                const std::filesystem::path& folder);

}  // namespace sheaf
