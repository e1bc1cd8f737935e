// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "geometry/rotation.h"
#include "io/colmap.h"
#include "io/models.h"
#include "scene/rigs.h"
#include "sheaf/problem.h"

namespace sheaf::test {

inline Pose pose_at(const Vector3<double>& turn_rad, const Vector3<double>& t) {
  return {quaternion_from_angle_axis(turn_rad), t};
}

/// A rig of two cameras with a lens each, `frames` frames of both, points that all images see, and
/// pixels a quarter off.
inline Problem rig_problem(std::uint32_t frames = 4) {
  Problem problem = seen_by({{CameraModel::pinhole, {500, 500, 320, 240}, 640, 480}}, 1, 12, 7);
  problem.observation_image.clear();
  problem.observation_point.clear();
  problem.observation_xy.clear();
  problem.poses.clear();
  problem.image_camera.clear();
  problem.cameras.push_back(problem.cameras[0]);
  problem.cameras[1].parameters[0] = 510;
  Rigs& rigs = problem.rigs;
  rigs.count = 1;
  rigs.sensor_from_rig = {Pose(), pose_at({0.02, -0.1, 0.05}, {-0.4, 0.03, 0.01})};
  rigs.sensor_rig = {0, 0};
  rigs.is_reference = {1, 0};
  for (std::uint32_t f = 0; f < frames; ++f) {
    rigs.rig_from_world.push_back(pose_at({0.1, 0.3 * f, -0.07}, {0.2 * f, 0.1, 5}));
    rigs.frame_rig.push_back(0);
    for (std::uint32_t s = 0; s < 2; ++s) {
      problem.add_image(pose_in_rig(rigs.sensor_from_rig[s], rigs.rig_from_world[f]), s);
      rigs.image_frame.push_back(f);
      rigs.image_sensor.push_back(s);
    }
  }
  for (std::uint32_t j = 0; j < problem.num_images(); ++j)
    for (std::uint32_t i = 0; i < problem.num_points(); ++i) {
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
      const double* X = &problem.points[3 * i];
      Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
      for (std::size_t k = 0; k < 3; ++k) P[k] += problem.poses[j].translation[k];
      const auto pixel = project(problem.cameras[problem.image_camera[j]], P).pixel;
      problem.add_observation(j, i, pixel[0] + 0.25, pixel[1]);
    }
  return problem;
}

/// The tiny model of text with what problems have no place for: a rig whose reference is an IMU
/// that has a camera's id, a sensor without a pose, a rig and a frame without images, measurements
/// of the IMU. Images 12 (camera 7) and 4, 9 (camera 3) are in two frames; image 4 is stated
/// elsewhere than its frame says.
inline ColmapFiles tiny_rigs() {
  ColmapFiles f = tiny_text();
  f.rigs =
      "# rigs of a person\n"
      "5 4 IMU 7 CAMERA 7 1 1 0 0 0 0 0 0.0 CAMERA 3 1 1 0 0 0 1.0 0 0 IMU 3 0\n"
      "\n"
      "8 2 IMU 1 CAMERA 3 0\n";
  f.frames =
      "# frames\n"
      "20 5 0.80 0.6 0 0 0.5 0.25 5 3 CAMERA 7 12 IMU 7 99 CAMERA 3 9\n"
      "21 5 0.8 0.6 0 0 1 0.25 5 1 CAMERA 3 4\n"
      "# no images\n"
      "22 8 0.5 0.5 0.5 0.5 0 0 0 1 IMU 1 4\n";
  return f;
}

}  // namespace sheaf::test
