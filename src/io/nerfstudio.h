// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/format.h"

namespace sheaf {

/// nerfstudio's transforms.json, for training, with the points in sparse_pc.ply beside it (text).
/// Frames are world_from_camera as 4 x 4 matrices, by rows, of cameras that look along -z with y up
/// (OpenGL's); the world is the problem's own. Files are images/NAME. Lenses stand once where there
/// is one, else with each frame: perspective ones with k1, k2, k3, p1, p2, and OPENCV_FISHEYE.
/// Errors: usage, for other lenses and for names that it cannot state.
Result<FormatOutput> format_nerfstudio(const Problem& problem);

}  // namespace sheaf
