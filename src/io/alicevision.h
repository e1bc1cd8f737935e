// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/format.h"

namespace sheaf {

/// AliceVision's .sfm (Meshroom's), JSON whose numbers are texts: views (id, pose, intrinsics,
/// path), intrinsics, poses (cam_from_world: the rotation by columns, and the centre), structure
/// (landmarks with their observations). Versions 1.0 to 1.2.x, which state focal lengths and
/// principal points differently: since 1.2.1 the latter count from the image's centre, since 1.2.2
/// the former are in millimetres of a sensor of that width. Pixels are taken as they are, as
/// AliceVision's own export to COLMAP does. The lenses:
///   pinhole, radial1 (radialk1), radial3 (radialk3), brown   the simplest that holds them
///   fisheye4 (fisheye), fisheye1                             OPENCV_FISHEYE, FOV
/// Others are refused by name. A view of a rig has the pose of its rig and its sub-pose.
bool is_alicevision(const JsonValue& root);
Result<Problem> parse_alicevision(const FormatInput& input);

/// Version 1.2.6, which everything since 2023 reads. Errors: usage, for lenses and names that it
/// cannot state.
Result<FormatOutput> format_alicevision(const Problem& problem);

}  // namespace sheaf
