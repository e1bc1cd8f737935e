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

TEST(RadialModels, OtherModelsAreRefusedByName) {
  Problem problem = disturbed({{CameraModel::radial, {700, 300, 230, -0.02, 0.01}},
                               {CameraModel::opencv, {500, 510, 320, 240, 0.01, 0, 0, 0}}},
                              3);
  const Problem start = problem;
  const Result<Summary> result = try_solve(problem);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(result.error().what()).find("camera 1 is OPENCV"), std::string::npos);
  EXPECT_TRUE(same_state(problem, start));
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

}  // namespace
}  // namespace sheaf
