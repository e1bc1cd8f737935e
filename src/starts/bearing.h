// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "geometry/rotation.h"
#include "sheaf/camera.h"

namespace sheaf {

/// The unit vector in the camera's frame that projects to a pixel, for any model: Gauss-Newton on
/// the sphere from where the lens without its distortion would have it. Nothing where no direction
/// that the camera sees comes within half a pixel.
std::optional<Vector3<double>> bearing(const Camera& camera, const double* pixel);

/// The camera without its distortion: all but focal lengths and principal point as in a lens that
/// has none.
Camera without_distortion(const Camera& camera);

}  // namespace sheaf
