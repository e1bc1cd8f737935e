// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_LENS_SWITCH_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_LENS_SWITCH_H_

#include "geometry/bal_lens.h"
#include "geometry/division_lens.h"
#include "geometry/equirectangular_lens.h"
#include "geometry/eucm_lens.h"
#include "geometry/fisheye_lens.h"
#include "geometry/fov_lens.h"
#include "geometry/perspective_lens.h"
#include "geometry/sphere_lens.h"

namespace SHEAF_LENS_NAMESPACE {

/// The one switch over camera models: calls use(Lens()) with the model's own type, which has
///   kName, kColmapId, kParameters,
///   project(k, P, LensJacobian&): pixel and Jacobians at P in the camera's frame, parameters k,
///   sees(k, P): whether P lies where the model is meant to be used,
///   and kImageSize where some parameters are the size of its images.
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
    case CameraModel::rad_tan_thin_prism_fisheye:
      return use(RadTanThinPrismFisheyeLens());
    case CameraModel::simple_division:
      return use(SimpleDivisionLens());
    case CameraModel::division:
      return use(DivisionLens());
    case CameraModel::simple_fisheye:
      return use(SimpleFisheyeLens());
    case CameraModel::fisheye:
      return use(FisheyeLens());
    case CameraModel::equirectangular:
      return use(EquirectangularLens());
    case CameraModel::radial_k3:
      return use(RadialK3Lens());
    case CameraModel::double_sphere:
      return use(DoubleSphereLens());
    case CameraModel::ucm:
      return use(UcmLens());
  }
  return use(BalLens());
}

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_LENS_SWITCH_H_
