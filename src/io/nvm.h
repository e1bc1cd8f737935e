// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

inline constexpr std::string_view kNvmMark = "NVM_V3";

/// VisualSFM's NVM_V3 (and NVM_V3_R9T), numbers separated by white space behind the mark:
///   <images>
///   <name> <f> <q, 4> <centre, 3> <r> 0         (R9T: the rotation matrix, 9, and t, 3)
///   <points>
///   <X> <Y> <Z>  <r> <g> <b>  <views> {<image> <feature> <x> <y>}
/// for the first model of the file. Cameras look along +z with y down; measurements m count from
/// the image centre. A radial coefficient r other than 0 makes them straight, m (1 + r |m|^2 /
/// f^2): that is what the problem observes, with a SIMPLE_PINHOLE lens for each image. Errors:
/// unreadable_input, as FILE:LINE: found this, expected that.
Result<Problem> parse_nvm(std::string_view text, const std::string& name,
                          std::vector<std::string>& notes);

/// Errors: usage, for cameras with distortion, which NVM states for measurements and not for
/// lenses.
Result<std::string> format_nvm(const Problem& problem);

}  // namespace sheaf
