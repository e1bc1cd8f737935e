// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace sheaf {
namespace {

SolverRun a_run(const char* solver, double total_s, double cost, const char* failed = "") {
  SolverRun run;
  run.solver = solver;
  run.total_s = total_s;
  run.final_cost = run.final_cost_independent = cost;
  run.failed = failed;
  return run;
}

TEST(StepTimesTest, TellsAcceptedFromRejected) {
  const StepTimes steps = step_times({{1, 100}, {2, 100}, {4, 100}, {8, 50}, {9, 20}});
  EXPECT_EQ(steps.accepted, 2);
  EXPECT_EQ(steps.rejected, 2);
  EXPECT_DOUBLE_EQ(steps.accepted_s, 2.5);
  EXPECT_DOUBLE_EQ(steps.rejected_s, 1.5);
  EXPECT_DOUBLE_EQ(steps.step_s, 2);
  EXPECT_EQ(step_times({{1, 5}}).accepted, 0);
  EXPECT_EQ(step_times({}).step_s, 0);
}

TEST(HeldCosts, KeepsTheCostBeforeARefusedState) {
  const CostTrace told = {{0, 9}, {1, 5}, {2, 7}, {3, NAN}, {4, 4}};
  EXPECT_EQ(held_costs(told), (CostTrace{{0, 9}, {1, 5}, {2, 5}, {3, 5}, {4, 4}}));
  EXPECT_EQ(held_costs({}), CostTrace());
}

TEST(TimeTo, IsTheFirstTimeAtOrBelow) {
  const CostTrace trace = {{1, 100}, {2, 60}, {3, 50}, {4, 50}};
  EXPECT_EQ(time_to(trace, 60), 2);
  EXPECT_EQ(time_to(trace, 59), 3);
  EXPECT_FALSE(time_to(trace, 49).has_value());
  EXPECT_FALSE(time_to({}, 49).has_value());
}

TEST(BestCost, CountsOnlyWhatRanAndIsFinite) {
  EXPECT_EQ(best_cost({a_run("a", 1, 5), a_run("b", 1, 3, "crashed"), a_run("c", 1, NAN)}), 5);
  EXPECT_TRUE(std::isinf(best_cost({})));
}

TEST(MedianRuns, OneForEachSolver) {
  const std::vector<SolverRun> runs = {
      a_run("a", 9, 1),         a_run("b", 1, 1, "hung"),    a_run("a", 2, 1),
      a_run("b", 1, 1, "hung"), a_run("a", 1, 1, "crashed"), a_run("a", 5, 1)};
  EXPECT_EQ(median_runs(runs), (std::vector<std::size_t>{5, 1}));
}

TEST(Agrees, HoldsTheOwnCostAgainstTheIndependentOne) {
  SolverRun run = a_run("a", 1, 100);
  EXPECT_TRUE(run.agrees());
  run.final_cost = 100 + 1e-6;
  EXPECT_FALSE(run.agrees());
}

TEST(WhatMoved, SeesWhatWasToBeHeldAndNothingElse) {
  Problem before;
  before.add_point(1, 2, 3);
  for (double f : {500.0, 600.0}) before.add_image(Pose{}, Camera{CameraModel::bal, {f, 0.1, 0.2}});
  Problem after = before;
  const auto moved = [&](const Fixed& fixed) { return what_moved(before, after, fixed); };
  Fixed all;
  all.points = all.poses = all.f = all.k1 = all.k2 = true;
  EXPECT_EQ(moved(all), "");
  after.points[1] += 1e-6;
  EXPECT_EQ(moved(all), "points");
  EXPECT_EQ(moved({}), "");
  after = before;
  after.poses[1].rotation = {-1, 0, 0, 0};  // the same rotation
  EXPECT_EQ(moved(all), "");
  after.poses[1].rotation = {std::cos(1e-5), std::sin(1e-5), 0, 0};
  EXPECT_EQ(moved(all), "poses");
  Fixed one;
  one.pose_ids = {0};
  EXPECT_EQ(moved(one), "");
  one.pose_ids = {1};
  EXPECT_EQ(moved(one), "poses");
  after = before;
  after.cameras[1].parameters[2] += 1e-6;
  EXPECT_EQ(moved(all), "k2");
  Fixed lens;
  lens.camera_ids = {1};
  EXPECT_EQ(moved(lens), "k2");
  lens.camera_ids = {0};
  EXPECT_EQ(moved(lens), "");
}

}  // namespace
}  // namespace sheaf
