// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "covariance/noisy_copies.h"
#include "sheaf/scene.h"
#include "solve/rig_problems.h"

namespace sheaf {
namespace {

using test::Ratios;
using test::Study;
using test::Tally;

/// Images around a cloud of points, and what they would measure without noise.
Problem around(CameraModel model, std::uint64_t images, std::uint64_t points, double track) {
  LensSceneOptions options;
  options.model = model;
  options.lenses = 1;
  options.scene.images = images;
  options.scene.points = points;
  options.scene.mean_track = track;
  options.scene.pixel_noise_px = 0;
  options.scene.seed = 5;
  return generate(options).value().truth;
}

/// Residuals in sigmas, as terms have them.
void state_sigmas(Study& study) {
  study.truth.observation_sigma.assign(study.truth.num_observations(), study.pixel);
}

void run(const Study& study, Tally& tally) {
  SolveOptions how;
  how.fixed = study.fixed;
  how.loss = study.loss;
  how.tolerance = 1e-12;
  how.threads = 1;
  CovarianceOptions what;
  what.fixed = study.fixed;
  what.loss = study.loss;
  what.threads = 1;
  for (int copy = 0; copy < study.copies; ++copy) {
    Problem p = test::measured_again(study, static_cast<std::uint64_t>(copy));
    const Summary summary = solve(p, how);
    ASSERT_NE(summary.termination, Termination::max_iterations) << copy;
    ASSERT_TRUE(summary.usable()) << summary.words;
    const Result<Covariance> c = covariance(p, what);
    ASSERT_TRUE(c.ok()) << c.error().what();
    ASSERT_EQ(c.value().deficit, study.aligned ? 7 : 0);
    if (study.aligned) test::align(p, study.truth);
    test::add_copy(p, study.truth, c.value(), tally);
  }
}

/// For the test's report (--gtest_output=json:FILE).
void record(const std::string& kind, const std::string& what, double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.4f", value);
  testing::Test::RecordProperty(kind + " " + what, text);
}

/// Of 400 copies a single sigma is known to 3.5 %: 15 % is 4.2 times that. A block's chi-square is
/// held against its quantiles of half a percent on either side.
void expect_told(const Study& study, const std::vector<std::string>& kinds) {
  Tally tally;
  run(study, tally);
  if (testing::Test::HasFatalFailure()) return;
  for (const std::string& kind : kinds) {
    SCOPED_TRACE(kind);
    const Ratios r = test::ratios(tally, kind);
    record(kind, "ratio", r.mean);
    record(kind, "least", r.least);
    record(kind, "most", r.most);
    EXPECT_NEAR(r.mean, 1, kind == "pose" ? 0.05 : 0.1);
    EXPECT_GT(r.least, 0.85);
    EXPECT_LT(r.most, 1.15);
    // The third block of the kind, or the only one: fixed beforehand.
    const test::Block* fixed = nullptr;
    int at = 0;
    for (const test::Block& block : tally.blocks())
      if (block.kind == kind && at++ < 3) fixed = &block;
    ASSERT_NE(fixed, nullptr);
    const double deviate = test::chi_square_deviate(*fixed, tally.copies());
    record(kind, "chi-square deviate", deviate);
    EXPECT_LT(std::abs(deviate), 2.576);
  }
}

TEST(CovarianceMonteCarlo, FreeScene) {
  Study study{.truth = around(CameraModel::radial, 8, 70, 5)};
  study.fixed.intrinsics = true;
  expect_told(study, {"pose", "point"});
}

TEST(CovarianceMonteCarlo, MeasuredPositions) {
  Study study{.truth = around(CameraModel::radial, 8, 70, 5), .aligned = false, .seed = 2};
  study.fixed.intrinsics = true;
  state_sigmas(study);
  for (std::uint32_t i = 0; i < study.truth.num_images(); ++i) {
    const Pose& pose = study.truth.poses[i];
    const auto C = camera_centre(matrix_from_quaternion(pose.rotation), pose);
    study.truth.terms.centres.push_back(
        {i, {C[0], C[1], C[2]}, {4e-4, 1e-4, 0, 1e-4, 4e-4, 0, 0, 0, 9e-4}, {}, {}});
  }
  expect_told(study, {"pose", "point"});
}

TEST(CovarianceMonteCarlo, ControlPoints) {
  Study study{.truth = around(CameraModel::radial, 8, 70, 5), .aligned = false, .seed = 3};
  study.fixed.intrinsics = true;
  state_sigmas(study);
  const std::vector<double>& X = study.truth.points;
  for (std::uint32_t j = 0; j < 60; j += 12)
    study.truth.terms.points.push_back(
        {j, {X[3 * j], X[3 * j + 1], X[3 * j + 2]}, {1e-4, 2e-5, 0, 2e-5, 1e-4, 0, 0, 0, 4e-4}});
  expect_told(study, {"pose", "point"});
}

TEST(CovarianceMonteCarlo, SharedLens) {
  const Study study{.truth = around(CameraModel::opencv, 8, 70, 5), .seed = 4};
  expect_told(study, {"pose", "lens", "point"});
}

TEST(CovarianceMonteCarlo, Rigs) {
  Study study{.truth = test::rig_problem({.frames = 5,
                                          .points = 60,
                                          .model = CameraModel::radial,
                                          .pixel = 0,
                                          .pose = 0,
                                          .sensor = 0,
                                          .point = 0}),
              .seed = 5};
  study.fixed.intrinsics = true;
  expect_told(study, {"pose", "frame", "sensor", "point"});
}

/// Outliers are others in every copy. Points are seen by twelve images on average, so that those
/// that are wrong are nowhere most of them.
TEST(CovarianceMonteCarlo, OutliersUnderALoss) {
  Study study{.truth = test::rig_problem({.frames = 16,
                                          .sensors = 1,
                                          .points = 60,
                                          .model = CameraModel::radial,
                                          .pixel = 0,
                                          .pose = 0,
                                          .sensor = 0,
                                          .point = 0}),
              .outliers = 0.1,
              .seed = 6};
  study.truth.rigs = {};
  study.fixed.intrinsics = true;
  study.loss = Cauchy{2.5487 * study.pixel};
  expect_told(study, {"pose", "point"});
}

}  // namespace
}  // namespace sheaf
