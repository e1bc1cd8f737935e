// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "geometry/lens_switch.h"
#include "sheaf/camera.h"

namespace sheaf {

/// Pixel of a point P in the camera's frame, and whether the camera can see there.
struct Projected {
  std::array<double, 2> pixel;
  bool before;  ///< false: behind the camera, or beyond what the model is meant for
};
Projected project(const Camera& camera, const std::array<double, 3>& P);
bool sees(const Camera& camera, const std::array<double, 3>& P);
LensJacobian<double> project_with_jacobian(const Camera& camera, const std::array<double, 3>& P);

/// pixel - observed, px. A panorama joins at its left and right borders: there the difference in x
/// is the least of those that whole widths lead to. k: the model's parameters.
inline std::array<double, 2> residual(CameraModel model, const double* k,
                                      const std::array<double, 2>& pixel, const double* observed) {
  const bool joins = model == CameraModel::equirectangular;
  const double x = joins ? EquirectangularLens::nearest(k, pixel[0], observed[0]) : pixel[0];
  return {x - observed[0], pixel[1] - observed[1]};
}
inline std::array<double, 2> residual(const Camera& camera, const std::array<double, 2>& pixel,
                                      const double* observed) {
  return residual(camera.model, camera.parameters.data(), pixel, observed);
}

/// What parameters mean, for those who treat all models alike; -1 where the model has none.
struct ParameterRoles {
  int fx = 0, fy = 0;  ///< equal for models with one focal length
  int cx = -1, cy = -1;
  int k1 = -1, k2 = -1;  ///< the first two radial coefficients
};
ParameterRoles roles_of(CameraModel model);

/// The focal length; of a panorama w / 2 pi.
double pixels_per_radian(const Camera& camera);
/// Where the lens sees what is straight ahead, pixels: of most models (cx, cy).
std::array<double, 2> principal_point_of(const Camera& camera);

int colmap_id(CameraModel model);
std::optional<CameraModel> camera_model_of_colmap(int id);

}  // namespace sheaf
