// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/behind.h"

#include "geometry/camera_model.h"
#include "geometry/rotation.h"
#include "platform/parallel.h"

namespace sheaf {

std::vector<std::uint64_t> behind_camera(const Problem& problem, Threads& threads) {
  constexpr std::size_t kObservations = 65536;
  std::vector<Matrix3<double>> rotations;
  rotations.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) rotations.push_back(matrix_from_quaternion(pose.rotation));
  const std::size_t count = problem.num_observations();
  std::vector<std::vector<std::uint64_t>> parts((count + kObservations - 1) / kObservations);
  threads.for_ranges(count, kObservations, [&](std::size_t i, std::size_t end) {
    std::vector<std::uint64_t>& behind = parts[i / kObservations];
    for (; i < end; ++i) {
      const std::uint32_t image = problem.observation_image[i];
      const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
      Vector3<double> P = multiply(rotations[image], Vector3<double>{X[0], X[1], X[2]});
      for (std::size_t k = 0; k < 3; ++k) P[k] += problem.poses[image].translation[k];
      if (!sees(problem.cameras[problem.image_camera[image]], P)) behind.push_back(i);
    }
  });
  std::vector<std::uint64_t> all;
  for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace sheaf
