// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "sheaf/camera.h"

namespace sheaf {

/// Where a lens without distortion stops being one, as angles between its optical axis and half the
/// longer side of its images: below a quarter of a degree (0.5 degrees across), above 87.5 (175
/// across) for models of a plane, above 180 (360 across) for fisheyes.
bool absurd_focal(const Camera& camera, double half_size_px);

/// Parameters for which a model's formula is not meant: an alpha outside [0, 1] (EUCM, UCM,
/// DOUBLE_SPHERE), EUCM's beta not above 0, DOUBLE_SPHERE's xi not between -1 and 1, FOV's omega of
/// pi or more, EQUIRECTANGULAR's w or h not above 0.
bool outside_model(const Camera& camera);

/// Whether distortion moves the edge, a pixel less the principal point, to less than a tenth of its
/// distance from there or to more than ten times it. The ray is the one that meets the edge without
/// distortion; with models that have no such ray (FOV, EUCM, UCM, DOUBLE_SPHERE and the division
/// models) the one that meets it, or the last one, which has to get a tenth of the way. Never with
/// EQUIRECTANGULAR.
bool absurd_distortion(const Camera& camera, const std::array<double, 2>& edge);

/// What a lens makes of one half plane of rays, from its axis to where they meet an edge. Nine
/// tenths of the edge's distance are looked at: a start may have its focal length off by a tenth.
enum class LensCourse {
  sound,  ///< pixels move outward all the way
  ends,   ///< no ray gets that far
  folds,  ///< pixels turn back before: two rays have one pixel
};
LensCourse course_of(const Camera& camera, const std::array<double, 2>& edge);

}  // namespace sheaf
