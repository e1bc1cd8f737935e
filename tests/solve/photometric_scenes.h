// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

#include "geometry/rotation.h"
#include "sheaf/photometric.h"

namespace sheaf::test {

/// Where a point X, Y, Z is seen, by plain code.
inline std::array<double, 2> project(const PhotometricProblem& p, std::size_t image,
                                     std::size_t point) {
  const Pose& pose = p.poses[image];
  const Vector3<double> P = multiply(
      matrix_from_quaternion(pose.rotation),
      Vector3<double>{p.points[3 * point], p.points[3 * point + 1], p.points[3 * point + 2]});
  const double z = P[2] + pose.translation[2];
  return {p.camera.fx * (P[0] + pose.translation[0]) / z + p.camera.cx,
          p.camera.fy * (P[1] + pose.translation[1]) / z + p.camera.cy};
}

}  // namespace sheaf::test
