// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// COLMAP's lenses that BAL's formula describes are refined as they are: the same problem stated
// with BAL cameras takes the same way, and what a model does not have stays as it is.
#include <gtest/gtest.h>

#include <cstdlib>

#include "io/models.h"
#include "scene/camera_frame.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

using namespace test;

Problem disturbed(const std::vector<Camera>& lenses, unsigned seed) {
  Problem problem = seen_by(lenses, 6, 60, seed);
  std::mt19937 random(seed + 100);
  std::normal_distribution<double> normal;
  for (double& x : problem.observation_xy) x += 0.3 * normal(random);
  for (double& x : problem.points) x += 0.01 * normal(random);
  return problem;
}

const std::vector<Camera> kLenses{{CameraModel::simple_pinhole, {500, 320, 240}, 640, 480},
                                  {CameraModel::simple_radial, {600, 310, 250, 0.02}, 640, 480},
                                  {CameraModel::radial, {700, 300, 230, -0.02, 0.01}, 640, 480}};

TEST(RadialModels, AreRefinedLikeBalCameras) {
  Problem problem = disturbed(kLenses, 1);
  const Problem start = problem;
  Problem as_bal = problem;
  ASSERT_TRUE(to_bal_cameras(as_bal).ok());
  const Summary summary = solve(problem, {.tolerance = 1e-12});
  SolveOptions held{.tolerance = 1e-12};
  held.fixed.k1_ids = {0};
  held.fixed.k2_ids = {0, 1};
  const Summary bal = solve(as_bal, held);
  EXPECT_NEAR(summary.initial_cost, evaluate(start).cost, 1e-12 * summary.initial_cost);
  EXPECT_EQ(summary.final_cost, bal.final_cost);
  EXPECT_NEAR(summary.final_cost, evaluate(problem).cost, 1e-12 * summary.final_cost);
  EXPECT_LT(summary.final_cost, 0.5 * summary.initial_cost);
  EXPECT_EQ(problem.points, as_bal.points);
  EXPECT_EQ(problem.observation_xy, start.observation_xy);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(problem.cameras[c].model, start.cameras[c].model);
    EXPECT_EQ(problem.cameras[c].parameters[1], start.cameras[c].parameters[1]) << "cx is held";
    EXPECT_EQ(problem.cameras[c].parameters[2], start.cameras[c].parameters[2]) << "cy is held";
    EXPECT_NE(problem.cameras[c].parameters[0], start.cameras[c].parameters[0]);
    EXPECT_EQ(problem.cameras[c].parameters[0], as_bal.cameras[c].parameters[0]);
  }
  EXPECT_EQ(as_bal.cameras[0].parameters[1], 0);
  EXPECT_EQ(as_bal.cameras[1].parameters[2], 0);
  EXPECT_NE(problem.cameras[1].parameters[3], start.cameras[1].parameters[3]);
  EXPECT_NE(problem.cameras[2].parameters[4], start.cameras[2].parameters[4]);
}

TEST(RadialModels, WhatIsHeldStaysBitForBit) {
  Problem problem = disturbed(kLenses, 2);
  const Problem start = problem;
  SolveOptions options;
  options.fixed.pose_ids = {1, 4};
  options.fixed.camera_ids = {2};
  solve(problem, options);
  for (std::size_t j : {1u, 4u}) {
    EXPECT_EQ(problem.poses[j].rotation, start.poses[j].rotation);
    EXPECT_EQ(problem.poses[j].translation, start.poses[j].translation);
  }
  EXPECT_NE(problem.poses[0].translation, start.poses[0].translation);
  EXPECT_EQ(problem.cameras[2].parameters, start.cameras[2].parameters);
  EXPECT_NE(problem.cameras[1].parameters, start.cameras[1].parameters);
}

/// A lens of another model that nobody looks through sends the problem the way of any lens.
TEST(RadialModels, AgreeWithTheWayOfAnyLens) {
  for (std::size_t images : {3u, 6u}) {  // with lenses of their own, and shared
    Problem problem = seen_by(kLenses, images, 60, 5);
    for (std::size_t i = 0; i < problem.points.size(); ++i)
      problem.points[i] += 0.01 * std::sin(static_cast<double>(i));
    Problem other = problem;
    other.cameras.push_back({CameraModel::opencv, {500, 510, 320, 240, 0.01, 0, 0, 0}});
    SolveOptions options;
    options.max_iterations = 1;
    const Summary summary = solve(problem, options), otherwise = solve(other, options);
    EXPECT_NEAR(otherwise.initial_cost, summary.initial_cost, 1e-12 * summary.initial_cost);
    EXPECT_NEAR(otherwise.final_cost, summary.final_cost, 1e-9 * summary.final_cost);
    EXPECT_NEAR(otherwise.iterations[1].gain_ratio, summary.iterations[1].gain_ratio, 1e-9);
    for (std::size_t i = 0; i < problem.points.size(); ++i)
      EXPECT_NEAR(other.points[i], problem.points[i], 1e-11);
    for (std::size_t c = 0; c < kLenses.size(); ++c)
      for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
        EXPECT_NEAR(other.cameras[c].parameters[k], problem.cameras[c].parameters[k],
                    1e-11 * (1 + std::abs(problem.cameras[c].parameters[k])));
  }
}

/// Real models, one lens each: their starts, and the optima that COLMAP 4.2.1's bundle adjustment
/// ends at under the same terms (f and k refined, principal point held; tolerances 1e-14).
TEST(RadialModels, RealModelsReachTheOptimaOfAnotherSolver) {
  const char* root = std::getenv("SHEAF_DATA");
  const std::filesystem::path data = std::filesystem::path(root ? root : "data") / "colmap";
  if (!std::filesystem::is_directory(data)) GTEST_SKIP() << "no real models";
  struct Known {
    const char* name;
    double start, optimum;
  };
  for (const Known& known : {Known{"gtsfm-lund-door-12", 1.092982e4, 1.092234322139e4},
                             Known{"gtsfm-crane-mast-8", 5.841335e3, 5.837894924153e3}}) {
    Problem problem = read(data / known.name).value();
    const Summary summary = solve(problem, {.tolerance = 1e-13});
    EXPECT_NEAR(summary.initial_cost, known.start, 1e-6 * known.start);
    EXPECT_NEAR(summary.final_cost, known.optimum, 1e-9 * known.optimum);
    EXPECT_NEAR(evaluate(problem).cost, summary.final_cost, 1e-10 * summary.final_cost);
  }
}

/// The same model with its camera restated, against the same bundle adjustment.
TEST(RadialModels, RestatedModelsReachTheOptimaOfAnotherSolver) {
  const char* root = std::getenv("SHEAF_DATA");
  const auto path = std::filesystem::path(root ? root : "data") / "colmap" / "gtsfm-lund-door-12";
  if (!std::filesystem::is_directory(path)) GTEST_SKIP() << "no real models";
  struct Known {
    CameraModel model;
    double optimum;
  };
  for (const Known& known : {Known{CameraModel::opencv, 10894.328272986468},
                             Known{CameraModel::opencv_fisheye, 10911.988846836397},
                             Known{CameraModel::radial_fisheye, 10913.050333911513},
                             Known{CameraModel::thin_prism_fisheye, 10877.720292819507},
                             Known{CameraModel::fov, 10921.387904565412}}) {
    SCOPED_TRACE(to_string(known.model));
    Problem problem = read(path).value();
    for (Camera& camera : problem.cameras) {
      const auto [f, cx, cy] =
          std::array{camera.parameters[0], camera.parameters[1], camera.parameters[2]};
      camera.model = known.model;
      camera.parameters = {f, f, cx, cy, known.model == CameraModel::fov ? 0.1 : 0};
      if (known.model == CameraModel::radial_fisheye) camera.parameters = {f, cx, cy};
    }
    const Summary summary = solve(problem, {.tolerance = 1e-13});
    EXPECT_NEAR(summary.final_cost, known.optimum, 1e-9 * known.optimum);
    EXPECT_NEAR(evaluate(problem).cost, summary.final_cost, 1e-10 * summary.final_cost);
  }
}

}  // namespace
}  // namespace sheaf
