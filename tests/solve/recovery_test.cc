// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sheaf/io.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

/// Every image turned about its centre by some 0.8 radians.
Problem turned_scene() {
  Problem problem = small_scene().start;
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    Pose& pose = problem.poses[i];
    const double sign = i % 2 == 0 ? 1 : -1;
    turn_about_centre(pose, {0.6 * sign, 0.5, -0.4 * sign});
  }
  return problem;
}

double cost_from_good_start() {
  Problem problem = small_scene().start;
  return solve(problem).final_cost;
}

int passes_of(const Summary& s) {
  int passes = 0;
  for (const Recovery& r : s.recoveries) passes += r.passes;
  return passes;
}

TEST(Recovery, FindsTheMinimumFromTurnedImages) {
  Problem problem = turned_scene();
  SolveOptions options;
  options.max_iterations = 100;
  const Summary s = solve(problem, options);
  EXPECT_NEAR(s.final_cost, cost_from_good_start(), 1e-6 * s.final_cost);
  ASSERT_FALSE(s.recoveries.empty());
  EXPECT_TRUE(s.recoveries.front().taken);
  EXPECT_NEAR(evaluate(problem).cost, s.final_cost, 1e-10 * s.final_cost);
  const auto it = std::find_if(s.iterations.begin(), s.iterations.end(),
                               [](const Iteration& i) { return i.passes > 0; });
  ASSERT_NE(it, s.iterations.end());
  EXPECT_EQ(it->index, s.recoveries.front().after_step + 1);
  EXPECT_EQ(it->passes, s.recoveries.front().passes);
  double cost = s.initial_cost;
  for (const Iteration& i : s.iterations) {
    EXPECT_LE(i.cost, cost * (1 + 1e-12));
    cost = i.cost;
  }
  EXPECT_EQ(s.rounds.size(), 1u);
}

/// The cost that a file of tests/data ends at after 100 iterations.
double end_of(const std::string& name, int recoveries) {
  Problem problem = read_file(case_file(name)).value().problem;
  SolveOptions options;
  options.max_iterations = 100;
  options.recoveries = recoveries;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.recoveries.empty(), recoveries == 0);
  return s.final_cost;
}

TEST(Recovery, FindsTheBestCostsKnown) {
  EXPECT_NEAR(end_of("rot_0.5_3.txt", 3), 64.94707908, 1e-6);
  EXPECT_NEAR(end_of("khuge_1.txt", 3), 36.13370376, 1e-6);
  EXPECT_GT(end_of("rot_0.5_3.txt", 0), 1000) << "steps alone end beyond cameras";
}

TEST(Recovery, PassesCountAsIterations) {
  for (int most : {3, 8, 12, 30}) {
    Problem problem = turned_scene();
    SolveOptions options;
    options.max_iterations = most;
    const Summary s = solve(problem, options);
    int steps = 0;
    for (const Iteration& it : s.iterations) steps += it.index > 0 && it.passes == 0;
    EXPECT_LE(steps + passes_of(s), most);
    EXPECT_LE(s.final_cost, s.initial_cost);
    EXPECT_NEAR(evaluate(problem).cost, s.final_cost, 1e-9 * s.final_cost);
  }
}

TEST(Recovery, IsNotAskedFromGoodStarts) {
  Problem problem = small_scene().start;
  const Summary s = solve(problem);
  EXPECT_TRUE(s.recoveries.empty());
}

TEST(Recovery, ThreadsChangeNoBit) {
  Problem one = turned_scene(), three = turned_scene();
  SolveOptions options;
  options.threads = 1;
  solve(one, options);
  options.threads = 3;
  solve(three, options);
  EXPECT_EQ(one.points, three.points);
}

TEST(Recovery, HeldPosesAndLensesStay) {
  Problem problem = turned_scene();
  const Problem before = problem;
  SolveOptions options;
  options.fixed.poses = true;
  options.fixed.intrinsics = true;
  const Summary s = solve(problem, options);
  EXPECT_LE(s.final_cost, s.initial_cost);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    EXPECT_EQ(problem.poses[i].rotation, before.poses[i].rotation);
    EXPECT_EQ(problem.poses[i].translation, before.poses[i].translation);
    EXPECT_EQ(problem.cameras[i].parameters, before.cameras[i].parameters);
  }
  Problem held = turned_scene();
  options = {};
  options.fixed.points = true;
  options.max_iterations = 100;
  const Summary images = solve(held, options);
  EXPECT_EQ(held.points, before.points);
  EXPECT_LT(images.final_cost, 1e-2 * images.initial_cost);
}

TEST(Recovery, PutsNothingBehindWhereThatIsRefused) {
  Problem problem = turned_scene();
  SolveOptions options;
  options.cheirality = Cheirality::reject;
  options.max_iterations = 100;
  const std::vector<std::uint64_t> before = evaluate(problem).behind;
  solve(problem, options);
  const std::vector<std::uint64_t> after = evaluate(problem).behind;
  EXPECT_TRUE(std::includes(before.begin(), before.end(), after.begin(), after.end()));
}

TEST(Recovery, WorksUnderALoss) {
  Problem problem = turned_scene(), good = small_scene().start;
  SolveOptions options;
  options.loss = Huber{1.0};
  options.max_iterations = 100;
  const Summary s = solve(problem, options);
  const Summary from_good = solve(good, options);
  EXPECT_NEAR(s.final_cost, from_good.final_cost, 1e-5 * from_good.final_cost);
  EXPECT_NEAR(robust_cost(problem, {LossKind::huber, 1.0}), s.final_cost, 1e-9 * s.final_cost);
}

TEST(Recovery, StopsWhenAsked) {
  Problem problem = turned_scene();
  SolveOptions options;
  options.time_limit_s = 1e-9;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::time_limit);
}

// Set-up takes seconds on large scenes: it is given up too, whatever is being built.
TEST(Recovery, StopsWithinSetUp) {
  for (const CameraSolverKind solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_implicit}) {
    Problem problem = turned_scene();
    const Problem before = problem;
    StopSource source;
    source.request_stop();
    SolveOptions options;
    options.solver = solver;
    options.threads = 2;
    options.stop = source.get_token();
    const Summary s = solve(problem, options);
    EXPECT_EQ(s.termination, Termination::stopped);
    EXPECT_NE(s.words.find("before the first step"), std::string::npos) << s.words;
    EXPECT_EQ(s.final_cost, evaluate(before).cost);
    EXPECT_EQ(problem.points, before.points);
    EXPECT_EQ(problem.observation_xy, before.observation_xy);
    EXPECT_EQ(s.iterations.size(), 1u);
  }
}

}  // namespace
}  // namespace sheaf
