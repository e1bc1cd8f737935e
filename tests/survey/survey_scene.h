// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <string>

#include "geometry/rotation.h"
#include "platform/random.h"
#include "sheaf/scene.h"
#include "sheaf/survey.h"

namespace sheaf {

/// A generated scene and a survey of it: metres are a tenth of its unit, its world is turned upside
/// down, and coordinates are counted from far away.
struct SurveyScene {
  static constexpr double kScale = 10;
  Scene scene;
  std::array<double, 3> far{500000, 4650000, 300};

  explicit SurveyScene(std::uint64_t images = 40, std::uint64_t seed = 1) {
    LensSceneOptions options;
    options.lenses = 1;
    options.scene.images = images;
    options.scene.points = 1500;
    options.scene.seed = seed;
    scene = generate(options).value();
  }
  explicit SurveyScene(const LensSceneOptions& options) : scene(generate(options).value()) {}

  std::array<double, 3> world(const Vector3<double>& X) const {
    return {far[0] + kScale * X[0], far[1] - kScale * X[1], far[2] - kScale * X[2]};
  }
  std::array<double, 3> true_centre(std::size_t image) const {
    const Pose& pose = scene.truth.poses[image];
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    Vector3<double> C{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) C[k] -= R[3 * i + k] * pose.translation[i];
    return world(C);
  }
  const std::string& name(std::size_t image) const {
    return scene.start.metadata->image_names[image];
  }

  Constraints frame() const {
    Constraints out;
    out.paths = {"survey.json"};
    out.frame.kind = WorldKind::projected;
    return out;
  }
  /// A position of every image with normal errors.
  void add_positions(double sigma, Constraints& to) const {
    Random random(7);
    for (std::size_t j = 0; j < scene.truth.num_images(); ++j) {
      ImagePosition p;
      p.image = name(j);
      p.at = true_centre(j);
      for (double& x : p.at) x += sigma * random.normal();
      for (const std::size_t k : {0, 4, 8}) p.covariance[k] = sigma * sigma;
      p.line = j + 1;
      to.positions.push_back(p);
    }
  }
  /// Points of the scene that at least five images see, with the pixels that these measured.
  void add_points(std::size_t count, SurveyRole role, double sigma, std::size_t first,
                  Constraints& to) const {
    const Problem& p = scene.start;
    std::map<std::uint32_t, std::vector<SurveyMark>> marks;
    for (std::size_t i = 0; i < p.num_observations(); ++i)
      marks[p.observation_point[i]].push_back(
          {name(p.observation_image[i]),
           {p.observation_xy[2 * i], p.observation_xy[2 * i + 1]},
           1,
           1});
    Random random(11 + first);
    for (std::uint32_t k = first; count > 0; k += 37) {
      const std::uint32_t point = k % static_cast<std::uint32_t>(p.num_points());
      if (marks[point].size() < 5) continue;
      SurveyPoint out;
      out.id = "p" + std::to_string(point);
      out.role = role;
      const double* X = &scene.truth.points[3 * std::size_t(point)];
      out.at = world({X[0], X[1], X[2]});
      for (double& x : out.at) x += sigma * random.normal();
      out.sigma = {sigma, sigma, sigma};
      out.marks = marks[point];
      to.points.push_back(out);
      --count;
    }
  }
};

}  // namespace sheaf
