// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sheaf/error.h"

namespace sheaf {

/// cam_from_world: X_cam = R X_world + t.
struct Pose {
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< unit quaternion (w, x, y, z)
  std::array<double, 3> translation{0, 0, 0};  ///< t, scene units
};

/// Which formula maps a point in the camera's frame to pixels.
enum class CameraModel : std::uint8_t {
  bal,  ///< f, k1, k2: p = -X.xy / X.z, n = |p|^2, u = f (1 + k1 n + k2 n^2) p; looks along -z
};

/// Intrinsics of one lens.
struct Camera {
  CameraModel model = CameraModel::bal;
  std::array<double, 3> parameters{1, 0, 0};  ///< bal: f (px), k1, k2
};

/// A bundle adjustment problem as flat arrays. Observation i is of point `observation_point[i]` in
/// image `observation_image[i]` at pixel `observation_xy[2 i], observation_xy[2 i + 1]`, in any
/// order. Image j has the pose `poses[j]` and the lens `cameras[image_camera[j]]`; several images
/// may share one lens.
struct Problem {
  std::vector<Pose> poses;                  ///< one for each image
  std::vector<std::uint32_t> image_camera;  ///< one for each image: index into cameras
  std::vector<Camera> cameras;              ///< lenses
  std::vector<double> points;               ///< 3 x points: X, Y, Z, scene units
  std::vector<std::uint32_t> observation_image;
  std::vector<std::uint32_t> observation_point;
  std::vector<double> observation_xy;  ///< 2 x observations, pixels

  /// Rotations as a BAL file stated them (3 per image, angle-axis, radians), or empty. They are
  /// what a writer puts out for each pose whose quaternion is still the one they convert to, so
  /// that a rotation that was not touched comes back bit for bit.
  std::vector<double> bal_angle_axis;

  std::size_t num_images() const { return poses.size(); }
  std::size_t num_points() const { return points.size() / 3; }
  std::size_t num_observations() const { return observation_image.size(); }

  /// Adds an image with a lens of its own (or the lens `camera`) and returns its index.
  std::uint32_t add_image(const Pose& pose, const Camera& camera);
  std::uint32_t add_image(const Pose& pose, std::uint32_t camera);
  std::uint32_t add_point(double x, double y, double z);
  void add_observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px);
};

/// What the solver may not change. What is held does not move by a bit.
struct Fixed {
  bool points = false;
  bool poses = false;
  bool f = false;                         ///< focal lengths of all cameras
  bool k1 = false;                        ///< first radial coefficient of all cameras
  bool k2 = false;                        ///< second radial coefficient of all cameras
  std::vector<std::uint32_t> pose_ids;    ///< single poses, by image index
  std::vector<std::uint32_t> camera_ids;  ///< single lenses, all their parameters, by camera index
};

/// Checks sizes, index ranges, finite numbers and unit quaternions (to 1e-6). The message names
/// the first offending entry.
Result<void> validate(const Problem& problem);

/// Cost 1/2 sum |r|^2 of the plain (not robust) problem by straightforward scalar code, with
/// compensated summation. Independent of the solver's own evaluation.
struct Evaluation {
  double cost = 0;                    ///< 1/2 sum |r|^2, px^2
  double rms_px = 0;                  ///< sqrt(sum |r|^2 / observations): per observation
  std::vector<std::uint64_t> behind;  ///< observations whose point lies behind the camera
  std::vector<std::uint64_t>
      not_finite;  ///< observations whose residual is not finite; not in cost
};
Evaluation evaluate(const Problem& problem);

}  // namespace sheaf
