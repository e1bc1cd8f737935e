// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// g2o's text files, as far as they are bundle adjustment: a line for each
///   VERTEX_CAM id  t, q (x y z w)  fx fy cx cy baseline     world_from_cam, a PINHOLE of its own
///   VERTEX_SE3:EXPMAP id  t, q (x y z w)                    world_from_cam
///   PARAMS_CAMERAPARAMETERS id f cx cy baseline             a SIMPLE_PINHOLE
///   VERTEX_XYZ or VERTEX_TRACKXYZ id X Y Z
///   EDGE_PROJECT_P2MC point camera u v  information
///   EDGE_PROJECT_XYZ2UV:EXPMAP point pose parameters u v  information
/// Cameras look along +z with y down. The information (upper triangle of 2 x 2) must be a multiple
/// of the identity, and gives the observation's sigma. FIX and edges between cameras are not read,
/// with a note; edges of stereo or of other kinds are refused by name. Errors: unreadable_input, as
/// FILE:LINE: found this, expected that.
bool is_g2o(std::string_view head);
Result<Problem> parse_g2o(std::string_view text, const std::string& name,
                          std::vector<std::string>& notes);

}  // namespace sheaf
