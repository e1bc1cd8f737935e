// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

inline constexpr std::string_view kBundlerMark = "# Bundle file";

/// Bundler's v0.3, numbers separated by white space behind the mark:
///   <images> <points>
///   <f> <k1> <k2>  <R, 3 rows>  <t>                                for each image of its list
///   <X> <Y> <Z>  <r> <g> <b>  <views> {<image> <key> <x> <y>}      for each point
/// The camera is BAL's. Images with f = 0 were never placed: they are no images of the problem.
/// Errors: unreadable_input, as FILE:LINE: found this, expected that.
Result<Problem> parse_bundler(std::string_view text, const std::string& name,
                              std::vector<std::string>& notes);

/// Errors: usage, for cameras other than BAL's formula describes.
Result<std::string> format_bundler(const Problem& problem);

}  // namespace sheaf
