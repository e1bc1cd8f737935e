// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/format.h"

namespace sheaf {

/// OpenSfM's reconstruction.json: a list of reconstructions, each of cameras, shots and points by
/// their ids, with tracks.csv beside it, whose lines
///   shot <tab> track <tab> feature <tab> x <tab> y ...
/// are the observations: a shot and a point of that id. Pixels count from the image's centre, in
/// units of its larger side: x_px = x max(w, h) + w / 2, so that the centre of the first pixel is
/// at (0.5, 0.5). Shots are cam_from_world, rotations angle-axis. The lenses (focal lengths in the
/// same unit):
///   perspective                                 RADIAL
///   simple_radial, radial, brown                the simplest of docs/cameras.md that holds them
///   fisheye, fisheye_opencv                     RADIAL_FISHEYE, OPENCV_FISHEYE
///   spherical, twice as wide as high            EQUIRECTANGULAR
/// Others are refused by name. Of a list the first is read, as the largest stands there.
bool is_opensfm(const JsonValue& root);
Result<Problem> parse_opensfm(const FormatInput& input);

/// reconstruction.json, and tracks.csv (version 2) beside it. Members of shots and lenses that were
/// read and mean nothing here are written again. Errors: usage, for lenses and names that it cannot
/// state.
Result<FormatOutput> format_opensfm(const Problem& problem);

}  // namespace sheaf
