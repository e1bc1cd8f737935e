// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera_plane.h"

#include <cmath>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"

namespace sheaf {
namespace {

constexpr double kRounding = 1e-12;

/// Whether the camera sees one side of its plane in the direction of P and not the other.
bool view_ends_at_plane(const Camera& camera, const Vector3<double>& P) {
  const double near = 1e-9 * std::hypot(P[0], P[1]);
  return sees(camera, {P[0], P[1], near}) != sees(camera, {P[0], P[1], -near});
}

}  // namespace

PlaneSights plane_sights(const Problem& problem) {
  std::vector<Matrix3<double>> rotations;
  rotations.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) rotations.push_back(matrix_from_quaternion(pose.rotation));
  PlaneSights out;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i];
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    const Matrix3<double>& R = rotations[image];
    const auto& t = problem.poses[image].translation;
    Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
    bool zero[3];
    for (std::size_t k = 0; k < 3; ++k) {
      P[k] += t[k];
      const double size = std::abs(R[3 * k] * X[0]) + std::abs(R[3 * k + 1] * X[1]) +
                          std::abs(R[3 * k + 2] * X[2]) + std::abs(t[k]);
      zero[k] = std::abs(P[k]) <= kRounding * size;
    }
    if (!zero[2]) continue;
    if (zero[0] && zero[1])
      out.at_centre.push_back(i);
    else if (view_ends_at_plane(problem.cameras[problem.image_camera[image]], P))
      out.in_plane.push_back(i);
  }
  return out;
}

}  // namespace sheaf
