// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "geometry/loss.h"
#include "geometry/rotation.h"
#include "sheaf/sheaf.h"
#include "solve/photometric_scenes.h"

namespace sheaf {
namespace {

using test::project;

constexpr double kNone = std::numeric_limits<double>::infinity();

PhotometricSceneOptions measured_scene(double start_px) {
  PhotometricSceneOptions o;
  o.images = 5, o.points = 500, o.width = 256, o.height = 192;
  o.relief = 0.01, o.start_px = start_px, o.measured_px = 0.3;
  return o;
}

PhotometricOptions plain_options() {
  PhotometricOptions options;
  options.affine_brightness = false;
  options.loss = Huber{10};
  return options;
}

/// Share of the measured places that are within a tenth of a pixel of the truth's.
double converged(const PhotometricProblem& estimate, const PhotometricProblem& truth) {
  double near = 0;
  for (std::size_t m = 0; m < truth.num_measurements(); ++m) {
    const auto a = project(estimate, truth.measured_image[m], truth.measured_point[m]);
    const auto b = project(truth, truth.measured_image[m], truth.measured_point[m]);
    near += std::hypot(a[0] - b[0], a[1] - b[1]) < 0.1;
  }
  return near / static_cast<double>(truth.num_measurements());
}

TEST(Anchor, CostIsTheSumOfBoth) {
  const PhotometricProblem start = generate(measured_scene(2)).value().start;
  for (Parametrisation points : {Parametrisation::xyz, Parametrisation::inverse_depth})
    for (const Loss& loss : {Loss{}, Loss(Huber{3}), Loss(Cauchy{2})}) {
      PhotometricOptions options = plain_options();
      options.parametrisation = points;
      options.max_iterations = 0;
      options.anchor_loss = loss;
      PhotometricProblem problem = start;
      const double pixels = refine_photometric(problem, options).value().solve.final_cost;
      options.anchor_px = 0.7;
      const PhotometricSummary both = refine_photometric(problem, options).value();
      double measured = 0, square = 0;
      std::uint64_t count = 0;
      for (std::size_t m = 0; m < start.num_measurements(); ++m) {
        const std::uint32_t point = start.measured_point[m], image = start.measured_image[m];
        if (points == Parametrisation::inverse_depth && start.host[point] == image) continue;
        const auto at = project(start, image, point);
        const double dx = at[0] - start.measured_xy[2 * m];
        const double dy = at[1] - start.measured_xy[2 * m + 1], s = dx * dx + dy * dy;
        measured += evaluate_loss({loss.kind, loss.scale_px}, s / (0.7 * 0.7)).value;
        square += s;
        ++count;
      }
      const double sigma2 = both.anchor_sigma_grey * both.anchor_sigma_grey;
      EXPECT_GT(sigma2, 1);
      EXPECT_NEAR(both.solve.final_cost, pixels + sigma2 * measured / 2,
                  1e-9 * both.solve.final_cost);
      EXPECT_GT(sigma2 * measured, 0.1 * pixels);
      EXPECT_EQ(both.measurements, count);
      EXPECT_NEAR(both.initial_rms_px, std::sqrt(square / static_cast<double>(count)), 1e-9);
    }
}

TEST(Anchor, WithoutWeightIsAsWithoutMeasurements) {
  const PhotometricProblem start = generate(measured_scene(1)).value().start;
  PhotometricProblem none = start, weightless = start;
  none.measured_point.clear(), none.measured_image.clear(), none.measured_xy.clear();
  PhotometricOptions options = plain_options();
  options.max_iterations = 6;
  const PhotometricSummary without = refine_photometric(none, options).value();
  options.anchor_px = kNone;
  const PhotometricSummary with = refine_photometric(weightless, options).value();
  EXPECT_EQ(with.solve.final_cost, without.solve.final_cost);
  EXPECT_EQ(weightless.points, none.points);
  EXPECT_EQ(with.measurements, 0u);
  // Rows that weigh next to nothing go another way to the same end.
  PhotometricProblem light = start;
  options.anchor_px = 1e9;
  const PhotometricSummary far = refine_photometric(light, options).value();
  EXPECT_NEAR(far.solve.final_cost, without.solve.final_cost, 1e-9 * without.solve.final_cost);
  EXPECT_GT(far.measurements, 1000u);
}

// Half a wave of 12 px is 6: from 8 px away pixels alone lead a third of the patches elsewhere.
TEST(Anchor, WideStartsConvergeThatPixelsAloneDoNot) {
  const PhotometricScene scene = generate(measured_scene(8)).value();
  for (Parametrisation points : {Parametrisation::inverse_depth, Parametrisation::xyz}) {
    PhotometricOptions options = plain_options();
    options.parametrisation = points;
    PhotometricProblem alone = scene.start, anchored = scene.start;
    refine_photometric(alone, options).value();
    options.anchor_px = 0.3;
    const PhotometricSummary summary = refine_photometric(anchored, options).value();
    EXPECT_LT(converged(alone, scene.truth), 0.8);
    if (points == Parametrisation::inverse_depth)
      EXPECT_GT(converged(anchored, scene.truth), 0.99);
    else  // patches that only move are biased by scale and roll
      EXPECT_GT(converged(anchored, scene.truth), converged(alone, scene.truth) + 0.2);
    EXPECT_LT(summary.final_rms_px, 0.6);
  }
}

// In the limit the anchor is all there is: the bundle adjustment of reprojections has to end at the
// same cost, by other code.
TEST(Anchor, AloneItIsBundleAdjustment) {
  const PhotometricProblem start = generate(measured_scene(2)).value().start;
  Problem bundle;
  Camera lens;
  lens.model = CameraModel::simple_pinhole;
  lens.parameters = {start.camera.fx, start.camera.cx, start.camera.cy};
  bundle.cameras.push_back(lens);
  for (const Pose& pose : start.poses) bundle.add_image(pose, std::uint32_t{0});
  bundle.points = start.points;
  for (std::size_t m = 0; m < start.num_measurements(); ++m)
    bundle.add_observation(start.measured_image[m], start.measured_point[m],
                           start.measured_xy[2 * m], start.measured_xy[2 * m + 1]);
  SolveOptions reprojections;
  reprojections.fixed.camera_ids = {0};
  reprojections.tolerance = 1e-12;
  const double expected = solve(bundle, reprojections).final_cost;

  PhotometricProblem anchored = start;
  PhotometricOptions options = plain_options();
  options.parametrisation = Parametrisation::xyz;
  options.loss = Tukey{1e-3};  // of pixels that cost nothing: 2e-7 grey levels^2 each at most
  options.anchor_px = 1e-3;
  options.tolerance = 1e-12;
  options.max_iterations = 200;
  const PhotometricSummary summary = refine_photometric(anchored, options).value();
  const double square =
      summary.final_rms_px * summary.final_rms_px * static_cast<double>(summary.measurements) / 2;
  EXPECT_NEAR(square, expected, 1e-6 * expected);
}

TEST(Anchor, RobustLossesForgetWrongMeasurements) {
  PhotometricScene scene = generate(measured_scene(8)).value();
  for (std::size_t m = 0; m < scene.start.num_measurements(); m += 20)
    scene.start.measured_xy[2 * m] += 30;
  PhotometricOptions options = plain_options();
  options.anchor_px = 0.3;
  PhotometricProblem plain = scene.start, robust = scene.start;
  refine_photometric(plain, options).value();
  options.anchor_loss = Cauchy{2.385};
  refine_photometric(robust, options).value();
  EXPECT_LT(converged(plain, scene.truth), 0.5);
  EXPECT_GT(converged(robust, scene.truth), 0.97);
}

TEST(Anchor, GoesThroughThePyramidAndThreadsDoNotChangeABit) {
  const PhotometricScene scene = generate(measured_scene(6)).value();
  PhotometricOptions options;
  options.anchor_px = 0.5;
  options.levels = 3;
  options.rows = PatchRows::exact;
  PhotometricProblem one = scene.start, three = scene.start;
  options.threads = 1;
  refine_photometric(one, options).value();
  options.threads = 3;
  refine_photometric(three, options).value();
  EXPECT_GT(converged(one, scene.truth), 0.99);
  EXPECT_EQ(one.points, three.points);
}

TEST(Anchor, RefusesWhatContradicts) {
  const PhotometricProblem start = generate(measured_scene(1)).value().start;
  const auto message = [](PhotometricProblem problem, const PhotometricOptions& options) {
    const auto result = refine_photometric(problem, options);
    return result.ok() ? std::string() : std::string(result.error().what());
  };
  PhotometricOptions options;
  options.anchor_px = 0;
  EXPECT_NE(message(start, options).find("above 0"), std::string::npos);
  options.anchor_px = std::nan("");
  EXPECT_NE(message(start, options).find("above 0"), std::string::npos);
  options.anchor_px = 1;
  options.anchor_loss = Huber{};
  EXPECT_NE(message(start, options).find("standard deviations"), std::string::npos);
  options.anchor_loss = {};
  PhotometricProblem none = start;
  none.measured_point.clear(), none.measured_image.clear(), none.measured_xy.clear();
  EXPECT_NE(message(none, options).find("measured positions"), std::string::npos);
  PhotometricProblem short_of_one = start;
  short_of_one.measured_xy.pop_back();
  EXPECT_NE(message(short_of_one, options).find("one pixel each"), std::string::npos);
  PhotometricProblem elsewhere = start;
  elsewhere.measured_image[3] = 9;
  EXPECT_NE(message(elsewhere, options).find("measured position 3"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
