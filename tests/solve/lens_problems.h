// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "geometry/lenses.h"
#include "io/models.h"
#include "sheaf/problem.h"

namespace sheaf::test {

/// Noise on the measurements, a disturbed start.
inline Problem disturbed(const std::vector<Camera>& lenses, std::size_t images, std::size_t points,
                         unsigned seed) {
  Problem problem = seen_by(lenses, images, points, seed);
  std::mt19937 random(seed + 100);
  std::normal_distribution<double> normal;
  for (double& x : problem.observation_xy) x += 0.3 * normal(random);
  for (double& x : problem.points) x += 0.01 * normal(random);
  for (Camera& camera : problem.cameras)
    for (std::size_t k = 0; k < parameter_count(camera.model); ++k) {
      const double by = 1 + 1e-3 * normal(random);
      if (image_size(camera.model) == 0) camera.parameters[k] *= by;
    }
  return problem;
}

/// A copy of the problem in which every image has a lens of its own.
inline Problem unshared(Problem problem) {
  const std::vector<Camera> lenses = problem.cameras;
  problem.cameras.clear();
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    problem.cameras.push_back(lenses[problem.image_camera[i]]);
    problem.image_camera[i] = static_cast<std::uint32_t>(i);
  }
  return problem;
}

/// Leaves out observations, so that tracks have different lengths and images.
inline Problem thinned(const Problem& problem, unsigned seed) {
  Problem out = problem;
  out.observation_image.clear(), out.observation_point.clear(), out.observation_xy.clear();
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (random() % 4 != 0)
      out.add_observation(problem.observation_image[i], problem.observation_point[i],
                          problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]);
  return out;
}

inline std::vector<CameraModel> all_models() {
  std::vector<CameraModel> out;
  for (std::size_t m = 0; m < kCameraModels; ++m) out.push_back(static_cast<CameraModel>(m));
  return out;
}

inline Fixed nothing_held(const Problem& problem) {
  Fixed fixed;
  fixed.parameters.assign(problem.cameras.size(), 0);
  return fixed;
}

/// All models, one image each; then each model shared by two images; then some of each.
inline std::vector<Problem> mixtures() {
  std::vector<Camera> lenses;
  for (CameraModel model : all_models()) lenses.push_back(ordinary(model));
  const Problem one = thinned(disturbed(lenses, lenses.size(), 21, 5), 6);
  const Problem two = thinned(disturbed(lenses, 2 * lenses.size(), 11, 7), 8);
  const Problem some =
      thinned(disturbed({ordinary(CameraModel::opencv), ordinary(CameraModel::full_opencv),
                         ordinary(CameraModel::opencv), ordinary(CameraModel::thin_prism_fisheye)},
                        6, 21, 9),
              10);
  return {one, two, some};
}

}  // namespace sheaf::test
