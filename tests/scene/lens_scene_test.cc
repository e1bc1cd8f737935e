// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"

namespace sheaf {
namespace {

LensSceneOptions options_of(CameraModel model) {
  LensSceneOptions options;
  options.model = model;
  options.lenses = 1;
  options.scene.images = 24;
  options.scene.points = 500;
  options.scene.mean_track = 6;
  return options;
}

class LensScenes : public testing::TestWithParam<std::size_t> {
 protected:
  CameraModel model() const { return static_cast<CameraModel>(GetParam()); }
};

/// Largest angle of an observed ray from the optical axis, degrees.
double widest_deg(const Problem& p) {
  double widest = 0;
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    const std::uint32_t j = p.observation_image[i];
    const double* X = &p.points[3 * std::size_t{p.observation_point[i]}];
    Vector3<double> P =
        multiply(matrix_from_quaternion(p.poses[j].rotation), Vector3<double>{X[0], X[1], X[2]});
    for (std::size_t k = 0; k < 3; ++k) P[k] += p.poses[j].translation[k];
    widest = std::max(widest, std::atan2(std::hypot(P[0], P[1]), P[2]));
  }
  return widest * 180 / std::numbers::pi;
}

TEST_P(LensScenes, TruthIsExactAndEveryImageSeesEnough) {
  const LensSceneOptions options = options_of(model());
  const Scene scene = generate(options).value();
  ASSERT_TRUE(validate(scene.start).ok());
  ASSERT_TRUE(validate(scene.truth).ok());
  const Evaluation truth = evaluate(scene.truth);
  // Portable functions against the machine's own.
  EXPECT_LT(truth.rms_px, 1e-9);
  EXPECT_TRUE(truth.behind.empty());
  EXPECT_TRUE(truth.not_finite.empty());
  EXPECT_EQ(scene.truth.cameras.size(), 1u);
  EXPECT_EQ(scene.truth.cameras[0].model, model());
  std::vector<int> counts(options.scene.images, 0);
  for (const std::uint32_t j : scene.truth.observation_image) ++counts[j];
  EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 12);
  EXPECT_NEAR(static_cast<double>(scene.truth.num_observations()), 3000, 300);
  const Evaluation start = evaluate(scene.start);
  EXPECT_GT(start.rms_px, 1);
  EXPECT_LT(start.rms_px, 200);
  EXPECT_TRUE(start.not_finite.empty());
}

TEST_P(LensScenes, TheSameSeedGivesTheSameSceneAndNoiseOnlyMovesItsOwn) {
  LensSceneOptions options = options_of(model());
  options.lenses = 0;
  const Scene a = generate(options).value(), b = generate(options).value();
  EXPECT_EQ(state_hash(a.start), state_hash(b.start));
  EXPECT_EQ(a.truth.cameras.size(), 24u);
  if (image_size(model()) == 0) {
    EXPECT_NE(a.truth.cameras[0].parameters, a.truth.cameras[1].parameters);
  }
  options.scene.point_noise = 0;
  const Scene c = generate(options).value();
  EXPECT_EQ(c.start.points, c.truth.points);
  EXPECT_EQ(c.start.poses[3].translation, a.start.poses[3].translation);
  EXPECT_EQ(c.start.observation_xy, a.start.observation_xy);
  options.scene.seed = 2;
  EXPECT_NE(state_hash(generate(options).value().truth), state_hash(c.truth));
}

TEST_P(LensScenes, SolvesToTheNoise) {
  Scene scene = generate(options_of(model())).value();
  const Summary summary = try_solve(scene.start, {}).value();
  ASSERT_TRUE(summary.usable()) << summary.words;
  // 0.5 px each way, and 3 unknowns a point in some 6 observations.
  EXPECT_LT(summary.final_rms_px, 0.72);
  EXPECT_GT(summary.final_rms_px, 0.4);
}

INSTANTIATE_TEST_SUITE_P(Models, LensScenes, testing::Range<std::size_t>(0, kCameraModels),
                         [](const auto& info) {
                           return std::string(to_string(static_cast<CameraModel>(info.param)));
                         });

bool is_wide(CameraModel model) {
  const std::string name(to_string(model));
  return name.find("FISHEYE") != std::string::npos || name == "FOV" || name == "EUCM" ||
         name == "UCM" || name == "DOUBLE_SPHERE" || name == "EQUIRECTANGULAR";
}

/// 200 degrees: rays behind the image plane are ordinary.
TEST(WideLenses, SeeBehindThemselvesAndConvergeFromADegreeAndAPercent) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    LensSceneOptions options = options_of(static_cast<CameraModel>(m));
    if (!is_wide(options.model)) continue;
    options.scene.rotation_noise_rad = std::numbers::pi / 180;
    options.scene.focal_noise = 0.01;
    options.scene.center_noise = 0.04;  // 1% of the 4 units that points are away
    options.scene.point_noise = 0.04;
    Scene scene = generate(options).value();
    EXPECT_GT(widest_deg(scene.truth), 99) << to_string(options.model);
    Problem& problem = scene.start;
    const Summary summary = try_solve(problem, {}).value();
    ASSERT_TRUE(summary.usable()) << summary.words;
    EXPECT_LT(summary.final_rms_px, 0.72) << to_string(options.model);
    for (const Iteration& step : summary.iterations)
      EXPECT_TRUE(std::isfinite(step.trial_cost)) << to_string(options.model) << step.index;
    EXPECT_TRUE(evaluate(problem).not_finite.empty());
    const auto& before = scene.truth.cameras[0].parameters;
    const auto scale = [](const Camera& lens) {
      const auto& k = lens.parameters;  // of a double sphere xi has a part in it
      return lens.model == CameraModel::double_sphere ? k[0] / (1 + k[4]) : k[0];
    };
    EXPECT_NEAR(scale(problem.cameras[0]) / scale(scene.truth.cameras[0]), 1, 2e-3)
        << to_string(options.model);
    const auto centre = static_cast<std::size_t>(std::max(roles_of(options.model).cx, 0));
    EXPECT_EQ(problem.cameras[0].parameters[centre], before[centre]) << "what is held";
  }
}

TEST(LensSceneOptions, SeveralLensesAreSharedByHundredsOfViewsOfAPoint) {
  LensSceneOptions options = options_of(CameraModel::opencv);
  options.lenses = 3;
  options.scene.images = 250;
  options.scene.points = 120;
  options.scene.mean_track = 200;
  Scene scene = generate(options).value();
  std::vector<int> lengths(120, 0);
  for (const std::uint32_t i : scene.truth.observation_point) ++lengths[i];
  EXPECT_GT(*std::max_element(lengths.begin(), lengths.end()), 200);
  EXPECT_EQ(scene.truth.cameras.size(), 3u);
  const Summary summary = try_solve(scene.start, {}).value();
  ASSERT_TRUE(summary.usable()) << summary.words;
  EXPECT_NEAR(summary.final_rms_px, 0.7, 0.03);
}

TEST(LensSceneOptions, RefusesViewsThatAModelDoesNotHave) {
  LensSceneOptions options = options_of(CameraModel::opencv);
  options.field_of_view_deg = 150;
  const Result<Scene> refused = generate(options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(refused.error().what()).find("OPENCV lens must be from 5 to 110"),
            std::string::npos);
  options = options_of(CameraModel::eucm);
  options.field_of_view_deg = 60;
  EXPECT_TRUE(generate(options).ok());
  options.scene.mean_track = 1;
  EXPECT_FALSE(generate(options).ok());
}

}  // namespace
}  // namespace sheaf
