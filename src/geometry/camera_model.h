// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "geometry/bal_lens.h"
#include "geometry/eucm_lens.h"
#include "geometry/fisheye_lens.h"
#include "geometry/fov_lens.h"
#include "geometry/perspective_lens.h"
#include "sheaf/camera.h"

namespace sheaf {

/// The one switch over camera models: calls use(Lens()) with the model's own type, which has
///   kName, kColmapId, kParameters,
///   project(k, P, LensJacobian&): pixel and Jacobians at P in the camera's frame, parameters k,
///   sees(k, P): whether P lies where the model is meant to be used.
template <class Use>
decltype(auto) with_lens(CameraModel model, Use&& use) {
  switch (model) {
    case CameraModel::bal:
      break;
    case CameraModel::simple_pinhole:
      return use(SimplePinholeLens());
    case CameraModel::pinhole:
      return use(PinholeLens());
    case CameraModel::simple_radial:
      return use(SimpleRadialLens());
    case CameraModel::radial:
      return use(RadialLens());
    case CameraModel::opencv:
      return use(OpencvLens());
    case CameraModel::full_opencv:
      return use(FullOpencvLens());
    case CameraModel::opencv_fisheye:
      return use(OpencvFisheyeLens());
    case CameraModel::simple_radial_fisheye:
      return use(SimpleRadialFisheyeLens());
    case CameraModel::radial_fisheye:
      return use(RadialFisheyeLens());
    case CameraModel::thin_prism_fisheye:
      return use(ThinPrismFisheyeLens());
    case CameraModel::fov:
      return use(FovLens());
    case CameraModel::eucm:
      return use(EucmLens());
  }
  return use(BalLens());
}

/// Pixel of a point P in the camera's frame, and whether the camera can see there.
struct Projected {
  std::array<double, 2> pixel;
  bool before;  ///< false: behind the camera, or beyond what the model is meant for
};
Projected project(const Camera& camera, const std::array<double, 3>& P);
LensJacobian<double> project_with_jacobian(const Camera& camera, const std::array<double, 3>& P);

/// What parameters mean, for those who treat all models alike; -1 where the model has none.
struct ParameterRoles {
  int fx = 0, fy = 0;  ///< equal for models with one focal length
  int cx = -1, cy = -1;
  int k1 = -1, k2 = -1;  ///< the first two radial coefficients
};
ParameterRoles roles_of(CameraModel model);

int colmap_id(CameraModel model);
std::optional<CameraModel> camera_model_of_colmap(int id);

}  // namespace sheaf
