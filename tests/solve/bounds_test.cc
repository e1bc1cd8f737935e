// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "solve/lens_problems.h"
#include "solve/rig_problems.h"

namespace sheaf {
namespace {

using test::disturbed;

const std::vector<CameraSolverKind> kSolvers{CameraSolverKind::dense, CameraSolverKind::sparse,
                                             CameraSolverKind::iterative_explicit,
                                             CameraSolverKind::iterative_implicit};

/// All parameters of the one lens are free, the principal point too.
SolveOptions tight(std::size_t cameras = 1) {
  SolveOptions options;
  options.fixed.parameters.assign(cameras, 0);
  options.tolerance = 1e-14;
  options.threads = 1;
  return options;
}

Problem opencv() {
  Camera camera;
  camera.model = CameraModel::opencv;
  camera.parameters = {800, 810, 500, 400, -0.1, 0.02, 1e-3, -5e-4};
  camera.width_px = 1000, camera.height_px = 800;
  return disturbed({camera}, 8, 120, 5);
}

/// The same scene seen through BAL's lenses.
Problem bal() {
  SceneOptions options;
  options.images = 8, options.points = 120, options.seed = 3;
  Problem problem = generate(options).value().start;
  for (Camera& camera : problem.cameras) camera.parameters[0] *= 0.99;
  return problem;
}

/// A bound between the start and the free optimum, `share` of the way.
ParameterBound between(const Problem& start, const Problem& best, std::uint32_t parameter,
                       double share) {
  const double from = start.cameras[0].parameters[parameter];
  const double to = best.cameras[0].parameters[parameter];
  ParameterBound out{0, parameter};
  (to > from ? out.upper : out.lower) = from + share * (to - from);
  return out;
}
double end_of(const ParameterBound& bound) {
  return std::isfinite(bound.upper) ? bound.upper : bound.lower;
}

/// The optimum with parameters held where they are.
double cost_when_held(Problem problem, const std::vector<ParameterBound>& bounds) {
  problem.terms = {};
  SolveOptions options = tight(problem.cameras.size());
  for (const ParameterBound& bound : bounds) {
    problem.cameras[0].parameters[bound.parameter] = end_of(bound);
    options.fixed.parameters[0] |= ParameterSet(1) << bound.parameter;
  }
  return solve(problem, options).final_cost;
}

void expect_held_optimum(const Problem& start, const std::vector<std::uint32_t>& parameters) {
  Problem free = start;
  const double lowest = solve(free, tight(start.cameras.size())).final_cost;
  std::vector<ParameterBound> bounds;
  for (const std::uint32_t p : parameters) bounds.push_back(between(start, free, p, 0.4));
  const double held = cost_when_held(start, bounds);
  EXPECT_GT(held, lowest * (1 + 1e-6));
  for (const CameraSolverKind solver : kSolvers) {
    Problem problem = start;
    problem.terms.bounds = bounds;
    SolveOptions options = tight(problem.cameras.size());
    options.solver = solver;
    options.recoveries = 0;
    const Summary summary = solve(problem, options);
    EXPECT_NEAR(summary.final_cost, held, 1e-9 * held) << summary.solver;
    ASSERT_EQ(summary.at_bounds.size(), bounds.size()) << summary.solver;
    for (const ParameterBound& bound : bounds)
      EXPECT_EQ(problem.cameras[0].parameters[bound.parameter], end_of(bound));
  }
}

TEST(Bounds, AParameterAtItsBoundIsHeldThere) {
  expect_held_optimum(opencv(), {0});
  expect_held_optimum(opencv(), {4});
}

TEST(Bounds, SeveralParametersAreHeld) { expect_held_optimum(opencv(), {0, 4, 6}); }

TEST(Bounds, BalLensesHaveThemToo) { expect_held_optimum(bal(), {0}); }

TEST(Bounds, WhatIsNotReachedChangesNothing) {
  const Problem start = opencv();
  Problem free = start;
  const double lowest = solve(free, tight(start.cameras.size())).final_cost;
  Problem problem = start;
  problem.terms.bounds.push_back({0, 0, 400, 1600});
  problem.terms.bounds.push_back({0, 4, -1});
  const Summary summary = solve(problem, tight(problem.cameras.size()));
  EXPECT_NEAR(summary.final_cost, lowest, 1e-10 * lowest);
  EXPECT_TRUE(summary.at_bounds.empty());
}

TEST(Bounds, AParameterThatStartsAtItsBoundLeavesIt) {
  const Problem start = opencv();
  Problem free = start;
  const double lowest = solve(free, tight(start.cameras.size())).final_cost;
  Problem problem = start;
  ParameterBound bound = between(start, free, 0, 0);
  std::swap(bound.lower, bound.upper);
  if (std::isinf(bound.lower)) bound.lower = -std::numeric_limits<double>::infinity();
  if (std::isinf(bound.upper)) bound.upper = std::numeric_limits<double>::infinity();
  problem.terms.bounds.push_back(bound);
  EXPECT_NEAR(solve(problem, tight(problem.cameras.size())).final_cost, lowest, 1e-10 * lowest);
}

TEST(Bounds, LossesAndRigsGoWithThem) {
  Problem problem = test::rig_problem({.frames = 4, .points = 40, .model = CameraModel::opencv});
  problem.terms.bounds.push_back(
      {0, 0, problem.cameras[0].parameters[0] - 1e-3, problem.cameras[0].parameters[0] + 1e-3});
  SolveOptions options = tight(problem.cameras.size());
  options.loss = {LossKind::cauchy, 1};
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 5}) {
    Problem own = problem;
    options.threads = threads;
    const Summary summary = solve(own, options);
    EXPECT_TRUE(summary.usable());
    EXPECT_EQ(summary.at_bounds.size(), 1u);
    hashes.push_back(state_hash(own));
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Bounds, WhatIsWrongIsRefused) {
  const auto words = [](const ParameterBound& bound, TrustRegion rule = TrustRegion::lm) {
    Problem problem = opencv();
    problem.terms.bounds.push_back(bound);
    SolveOptions options = tight(problem.cameras.size());
    options.trust_region = rule;
    const Result<Summary> done = try_solve(problem, options);
    return done.ok() ? std::string() : std::string(done.error().what());
  };
  EXPECT_NE(words({0, 0, 900, 1000}).find("starts outside"), std::string::npos);
  EXPECT_NE(words({0, 0, 1000, 900}).find("above the upper"), std::string::npos);
  EXPECT_NE(words({0, 12}).find("parameters"), std::string::npos);
  EXPECT_NE(words({1, 0}).find("camera that there is not"), std::string::npos);
  EXPECT_NE(words({0, 0, 1, 9000}, TrustRegion::dogleg).find("dogleg"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
