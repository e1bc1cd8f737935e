// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// libmv's problem file, as Blender's tracker writes it and the example of Ceres Solver reads it.
/// Binary: 'v' (little-endian) or 'V', 'P' (pixels) or 'N' (normalised), eight floats f, cx, cy,
/// k1, k2, k3, p1, p2, then counted lists of int32 and float: cameras (image, R by columns, t),
/// points (track, X), markers (image, track, x, y).
inline bool is_libmv(std::string_view head) {
  return head.size() >= 2 && (head[0] == 'v' || head[0] == 'V') &&
         (head[1] == 'P' || head[1] == 'N');
}

/// One lens for all images: RADIAL where k3, p1 and p2 are 0, else FULL_OPENCV. Markers of images
/// that have no camera are left out, with a note; those of tracks that have no point are features
/// that nothing observes. Errors: unreadable_input, as FILE: byte N: found this, expected that.
Result<Problem> parse_libmv(std::string_view bytes, const std::string& name,
                            std::vector<std::string>& notes);

/// Little-endian, in single precision. Errors: usage for a problem of several lenses, or one that
/// f, cx, cy, k1, k2, k3, p1, p2 do not describe.
Result<std::string> format_libmv(const Problem& problem);

}  // namespace sheaf
