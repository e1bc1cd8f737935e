// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "starts/sights.h"

#include <limits>

#include "geometry/camera_model.h"

namespace sheaf {
namespace {

/// Counting sort of the observations that are not skipped by a key below `keys`.
void sort_by(const std::vector<std::uint32_t>& key, std::size_t keys,
             const std::vector<std::uint8_t>& skip, std::vector<std::uint64_t>& begin,
             std::vector<std::uint64_t>& sorted) {
  begin.assign(keys + 1, 0);
  for (std::size_t i = 0; i < key.size(); ++i)
    if (skip.empty() || !skip[i]) ++begin[key[i] + 1];
  for (std::size_t k = 0; k < keys; ++k) begin[k + 1] += begin[k];
  sorted.resize(begin[keys]);
  std::vector<std::uint64_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t i = 0; i < key.size(); ++i)
    if (skip.empty() || !skip[i]) sorted[next[key[i]]++] = i;
}

}  // namespace

Estimate estimate_of(const Problem& problem) {
  return {problem.poses, problem.cameras, problem.points, problem.rigs.sensor_from_rig,
          problem.rigs.rig_from_world};
}

void put(const Estimate& state, Problem& problem) {
  problem.poses = state.poses;
  problem.cameras = state.cameras;
  problem.points = state.points;
  problem.rigs.sensor_from_rig = state.sensors;
  problem.rigs.rig_from_world = state.frames;
}

Sights::Sights(const Problem& problem, const std::vector<std::uint8_t>& skip) : problem_(&problem) {
  sort_by(problem.observation_point, problem.num_points(), skip, point_begin_, by_point_);
  sort_by(problem.observation_image, problem.num_images(), skip, image_begin_, by_image_);
}

Fit fit_of(const Camera& camera, const Vector3<double>& P, const double* pixel,
           const ScaledLoss& loss) {
  const Projected seen = project(camera, P);
  const auto [x, y] = residual(camera, seen.pixel, pixel);
  return {0.5 * evaluate_loss(loss, x * x + y * y).value, seen.before ? 0u : 1u};
}

Fit fit_of_image(const Sights& sights, std::size_t image, const Estimate& state,
                 const ScaledLoss& loss) {
  const Matrix3<double> R = matrix_from_quaternion(state.poses[image].rotation);
  Fit all;
  for (std::uint64_t i : sights.of_image(image))
    all += fit_of(state.cameras[sights.camera_of(image)],
                  in_camera(R, state.poses[image], &state.points[3 * std::size_t(sights.point(i))]),
                  sights.pixel(i), loss);
  return all;
}

Vector3<double> turned_back(const Matrix3<double>& R, const Vector3<double>& v) {
  Vector3<double> out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = R[k] * v[0] + R[3 + k] * v[1] + R[6 + k] * v[2];
  return out;
}

Vector3<double> camera_centre(const Matrix3<double>& rotation, const Pose& pose) {
  Vector3<double> centre = turned_back(rotation, pose.translation);
  for (double& x : centre) x = -x;
  return centre;
}

Vector3<double> in_camera(const Matrix3<double>& rotation, const Pose& pose, const double* X) {
  Vector3<double> P = multiply(rotation, Vector3<double>{X[0], X[1], X[2]});
  for (std::size_t k = 0; k < 3; ++k) P[k] += pose.translation[k];
  return P;
}

}  // namespace sheaf
