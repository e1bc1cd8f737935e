// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/format.h"

namespace sheaf {

/// OpenMVG's sfm_data.json (versions 0.2 and 0.3): views (path, ids of pose and intrinsics),
/// intrinsics, extrinsics (cam_from_world: the rotation by rows, and the centre), structure (points
/// with their observations). Pointers stand as the cereal library writes them: by an id, with what
/// they point to where it occurs first, and with a type by its name likewise. Pixels are taken as
/// they are, as OpenMVG's own export to COLMAP does. The lenses, with one focal length:
///   pinhole, pinhole_radial_k1, pinhole_radial_k3, pinhole_brown_t2   the simplest that holds them
///   fisheye                                                           OPENCV_FISHEYE
///   spherical, twice as wide as high                                  EQUIRECTANGULAR
/// Others are refused by name.
bool is_openmvg(const JsonValue& root);
Result<Problem> parse_openmvg(const FormatInput& input);

/// Version 0.3. Errors: usage, for lenses (two focal lengths, say) and names that it cannot state.
Result<FormatOutput> format_openmvg(const Problem& problem);

}  // namespace sheaf
