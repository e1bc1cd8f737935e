// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace sheaf {

/// Which formula maps a point in the camera's frame to pixels; docs/cameras.md states them all.
/// `bal` looks along -z with y up, its pixels count from the image centre. All others look along
/// +z with y down, and their pixels count from the top left corner of the image: the centre of the
/// first pixel is (0.5, 0.5).
enum class CameraModel : std::uint8_t {
  bal,                    ///< f, k1, k2
  simple_pinhole,         ///< f, cx, cy
  pinhole,                ///< fx, fy, cx, cy
  simple_radial,          ///< f, cx, cy, k
  radial,                 ///< f, cx, cy, k1, k2
  opencv,                 ///< fx, fy, cx, cy, k1, k2, p1, p2
  full_opencv,            ///< fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6
  opencv_fisheye,         ///< fx, fy, cx, cy, k1, k2, k3, k4
  simple_radial_fisheye,  ///< f, cx, cy, k
  radial_fisheye,         ///< f, cx, cy, k1, k2
  thin_prism_fisheye,     ///< fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, sx1, sy1
  fov,                    ///< fx, fy, cx, cy, omega (rad)
  eucm,                   ///< fx, fy, cx, cy, alpha, beta; sees more than 180 degrees
  /// fx, fy, cx, cy, k0 to k5, p0, p1, s0 to s3
  rad_tan_thin_prism_fisheye,
  simple_division,  ///< f, cx, cy, k
  division,         ///< fx, fy, cx, cy, k
  simple_fisheye,   ///< f, cx, cy
  fisheye,          ///< fx, fy, cx, cy
  equirectangular,  ///< w, h: the size of a panorama (px), which is never refined
  radial_k3,        ///< f, cx, cy, k1, k2, k3
  double_sphere,    ///< fx, fy, cx, cy, xi, alpha; sees more than 180 degrees
  ucm,              ///< fx, fy, cx, cy, alpha; sees more than 180 degrees
};
inline constexpr std::size_t kCameraModels = 22;
inline constexpr std::size_t kMaxCameraParameters = 16;

/// Intrinsics of one lens.
struct Camera {
  CameraModel model = CameraModel::bal;
  /// In the order above; what the model does not have is 0. Lengths in pixels.
  std::array<double, kMaxCameraParameters> parameters{1};
  std::uint64_t width_px = 0, height_px = 0;  ///< of its images; 0: not known
};

/// Some of a model's parameters: bit i is the i-th in their order.
using ParameterSet = std::uint16_t;
/// Those of the principal point: what is held unless something else is asked for.
ParameterSet principal_point(CameraModel model);
/// Those that say how large the images are, and nothing of a lens: they are always held.
ParameterSet image_size(CameraModel model);

std::size_t parameter_count(CameraModel model);
std::vector<std::string_view> parameter_names(CameraModel model);

/// "OPENCV" and so on, as COLMAP calls them; "BAL" and others that it does not have.
std::string_view to_string(CameraModel model);
std::optional<CameraModel> camera_model_named(std::string_view name);

}  // namespace sheaf
