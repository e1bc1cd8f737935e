// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "platform/random.h"
#include "sheaf/solve.h"
#include "survey/survey_scene.h"
#include "survey/textbook_covariance.h"

namespace sheaf::test {

/// A survey of a generated scene with noise on all that was measured, and the same for the textbook
/// at the truth. Marks are measured anew: those of check points share no error with the adjustment.
class StudyScene {
 public:
  struct Check {
    std::string id;
    Eigen::Vector3d truth;  ///< in the local frame
    std::vector<TextbookSurvey::Sight> sights;
  };

  StudyScene(std::uint64_t images, std::uint64_t points, std::uint64_t seed)
      : made(options_of(images, points, seed)), random_(seed, 77) {
    constraints = made.frame();
    constraints.frame.origin = made.far;
    const Problem& truth = made.scene.truth;
    for (const Pose& pose : truth.poses) textbook.images.push_back(image_of(pose));
    const auto& lens = truth.cameras[0].parameters;
    textbook.lens << lens[0], lens[1], lens[2], lens[3];
    for (std::size_t i = 0; i < truth.num_points(); ++i)
      textbook.points.push_back(local(&truth.points[3 * i]));
    textbook.eliminated = truth.num_points();
    sights_.resize(truth.num_points());
    for (std::size_t i = 0; i < truth.num_observations(); ++i) {
      const std::uint32_t point = truth.observation_point[i];
      textbook.sights.push_back({truth.observation_image[i], point, 1});
      sights_[point].push_back(truth.observation_image[i]);
    }
  }

  /// Positions of all images.
  void add_positions(double sigma, const std::array<double, 3>& lever_arm, TermLoss loss = {}) {
    for (std::size_t j = 0; j < textbook.images.size(); ++j) {
      const TextbookSurvey::Image& image = textbook.images[j];
      const Eigen::Vector3d arm(lever_arm[0], lever_arm[1], lever_arm[2]);
      ImagePosition p;
      p.image = made.name(j);
      p.at = world(image.centre + image.rotation.transpose() * arm);
      for (double& x : p.at) x += sigma * random_.normal();
      for (const std::size_t k : {0, 4, 8}) p.covariance[k] = sigma * sigma;
      p.lever_arm = lever_arm;
      p.loss = loss;
      constraints.positions.push_back(p);
      textbook.positions.push_back({j, arm, sigma});
    }
  }

  /// Points where the scene has some that at least four images see; sigma counts for control.
  void add_points(std::size_t count, SurveyRole role, double sigma, double sigma_px) {
    while (count > 0) {
      const std::size_t like = random_.below(sights_.size());
      if (sights_[like].size() < 4) continue;
      const Eigen::Vector3d X = textbook.points[like];
      SurveyPoint point;
      point.id = "s" + std::to_string(constraints.points.size());
      point.role = role;
      point.at = world(X);
      if (role == SurveyRole::control)
        for (double& x : point.at) x += sigma * random_.normal();
      point.sigma = {sigma, sigma, sigma};
      std::vector<TextbookSurvey::Sight> sights;
      for (const std::uint32_t j : sights_[like]) {
        const Eigen::Vector2d pixel = pixel_of(textbook.images[j], textbook.lens, X);
        point.marks.push_back(
            {made.name(j),
             {pixel[0] + sigma_px * random_.normal(), pixel[1] + sigma_px * random_.normal()},
             sigma_px,
             1});
        sights.push_back({j, textbook.points.size(), sigma_px});
      }
      constraints.points.push_back(point);
      if (role == SurveyRole::check)
        checks.push_back({point.id, X, sights});
      else
        take_part(role, sigma, X, sights);
      sights_[like].clear();
      --count;
    }
  }

  /// Between the two points that were added last.
  void add_bar(double sigma) {
    const std::size_t n = constraints.points.size(), last = textbook.points.size() - 1;
    const double length = (textbook.points[last] - textbook.points[last - 1]).norm();
    constraints.scale_bars.push_back({constraints.points[n - 2].id, constraints.points[n - 1].id,
                                      length + sigma * random_.normal(), sigma});
    textbook.distances.push_back({last - 1, last, sigma});
  }

  Eigen::Vector3d local_of_world(const std::array<double, 3>& x) const {
    return {x[0] - made.far[0], x[1] - made.far[1], x[2] - made.far[2]};
  }

  SurveyScene made;
  Constraints constraints;
  TextbookSurvey textbook;
  std::vector<Check> checks;

 private:
  static LensSceneOptions options_of(std::uint64_t images, std::uint64_t points,
                                     std::uint64_t seed) {
    LensSceneOptions options;
    options.model = CameraModel::simple_radial;
    options.lenses = 1;
    options.scene.images = images;
    options.scene.points = points;
    options.scene.pixel_noise_px = 1;
    options.scene.seed = seed;
    return options;
  }
  static Eigen::Vector3d local(const double* X) {
    return SurveyScene::kScale * Eigen::Vector3d(X[0], -X[1], -X[2]);
  }
  std::array<double, 3> world(const Eigen::Vector3d& X) const {
    return {made.far[0] + X[0], made.far[1] + X[1], made.far[2] + X[2]};
  }
  static TextbookSurvey::Image image_of(const Pose& pose) {
    const auto& q = pose.rotation;
    const double w = q[0], x = q[1], y = q[2], z = q[3];
    Eigen::Matrix3d R;
    R << 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
        1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
        1 - 2 * (x * x + y * y);
    const Eigen::Vector3d turned(1, -1, -1);
    const Eigen::Vector3d t(pose.translation[0], pose.translation[1], pose.translation[2]);
    return {R * turned.asDiagonal(),
            SurveyScene::kScale * turned.asDiagonal() * (-R.transpose() * t)};
  }
  void take_part(SurveyRole role, double sigma, const Eigen::Vector3d& X,
                 const std::vector<TextbookSurvey::Sight>& sights) {
    if (role == SurveyRole::control)
      textbook.coordinates.push_back({textbook.points.size(), sigma});
    textbook.points.push_back(X);
    textbook.sights.insert(textbook.sights.end(), sights.begin(), sights.end());
  }

  Random random_;
  std::vector<std::vector<std::uint32_t>> sights_;  ///< images of each point of the scene
};

inline SolveOptions tight() {
  SolveOptions options;
  options.max_iterations = 100;
  options.tolerance = 1e-13;
  options.threads = 1;
  return options;
}

/// Errors over the sigmas of the textbook, their squares summed.
struct Normalised {
  double squares = 0, errors = 0, variances = 0;
  std::size_t count = 0;

  void add(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
    for (int k = 0; k < 3; ++k) {
      squares += error[k] * error[k] / covariance(k, k);
      errors += error[k] * error[k];
      variances += covariance(k, k);
      ++count;
    }
  }
  double rms_error() const { return std::sqrt(errors / static_cast<double>(count)); }
  double rms_sigma() const { return std::sqrt(variances / static_cast<double>(count)); }
  double rms() const { return std::sqrt(squares / static_cast<double>(count)); }
};

inline SurveyReport adjusted(const StudyScene& study) {
  Problem problem = study.made.scene.start;
  const Survey survey = place_survey(problem, study.constraints).value();
  EXPECT_TRUE(survey.unused.empty());
  solve(problem, tight());
  return finish_survey(problem, survey);
}

}  // namespace sheaf::test
