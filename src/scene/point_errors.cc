// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/point_errors.h"

#include <cmath>
#include <cstdint>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"
#include "platform/parallel.h"

namespace sheaf {

std::vector<double> residuals(const Problem& problem, int threads) {
  std::vector<Matrix3<double>> rotations;
  rotations.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) rotations.push_back(matrix_from_quaternion(pose.rotation));
  std::vector<double> out(2 * problem.num_observations());
  constexpr std::size_t kEach = 1 << 14;
  Threads(threads).for_ranges(
      problem.num_observations(), kEach, [&](std::size_t first, std::size_t end) {
        for (std::size_t i = first; i < end; ++i) {
          const std::uint32_t image = problem.observation_image[i];
          const double* X = &problem.points[3 * std::size_t{problem.observation_point[i]}];
          Vector3<double> P = multiply(rotations[image], Vector3<double>{X[0], X[1], X[2]});
          for (std::size_t k = 0; k < 3; ++k) P[k] += problem.poses[image].translation[k];
          const Camera& camera = problem.cameras[problem.image_camera[image]];
          const auto r = residual(camera, project(camera, P).pixel, &problem.observation_xy[2 * i]);
          out[2 * i] = r[0];
          out[2 * i + 1] = r[1];
        }
      });
  return out;
}

std::vector<double> residual_lengths(const Problem& problem, int threads) {
  const std::vector<double> r = residuals(problem, threads);
  std::vector<double> lengths(problem.num_observations());
  for (std::size_t i = 0; i < lengths.size(); ++i)
    // std::hypot's bits depend on the processor.
    lengths[i] = std::sqrt(r[2 * i] * r[2 * i] + r[2 * i + 1] * r[2 * i + 1]);
  return lengths;
}

std::vector<double> mean_point_errors(const Problem& problem) {
  const std::vector<double> lengths = residual_lengths(problem);
  std::vector<double> errors(problem.num_points(), 0);
  std::vector<std::uint32_t> counts(problem.num_points(), 0);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    errors[problem.observation_point[i]] += lengths[i];
    ++counts[problem.observation_point[i]];
  }
  for (std::size_t p = 0; p < errors.size(); ++p) {
    if (counts[p] > 0) errors[p] /= counts[p];
    if (!std::isfinite(errors[p])) errors[p] = -1;
  }
  return errors;
}

}  // namespace sheaf
