// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

/// The scene with `count` points moved behind the first image that sees them.
Problem with_points_behind(std::size_t count) {
  Problem problem = small_scene().start;
  std::uint32_t last = UINT32_MAX;
  for (std::size_t i = 0; i < problem.num_observations() && count > 0; i += 50) {
    const std::uint32_t point = problem.observation_point[i];
    if (point == last) continue;
    last = point;
    --count;
    const Pose& pose = problem.poses[problem.observation_image[i]];
    const auto R = matrix_from_quaternion(pose.rotation);
    Vector3<double> P = {0.5, 0.3, 2};  // in the camera's frame: it looks along -z
    for (int k = 0; k < 3; ++k) P[k] -= pose.translation[k];
    for (int k = 0; k < 3; ++k)
      problem.points[3 * point + k] = R[k] * P[0] + R[3 + k] * P[1] + R[6 + k] * P[2];
  }
  return problem;
}

bool contains_all(const std::vector<std::uint64_t>& all, const std::vector<std::uint64_t>& some) {
  return std::includes(all.begin(), all.end(), some.begin(), some.end());
}

TEST(Cheirality, FormulaCountsAndLists) {
  Problem problem = with_points_behind(5);
  const Problem before = problem;
  const Evaluation start = evaluate(before);
  ASSERT_GE(start.behind.size(), 5u);
  const Summary s = solve(problem);
  EXPECT_EQ(s.behind_camera_before, start.behind);
  EXPECT_EQ(s.behind_camera_after, evaluate(problem).behind);
  EXPECT_TRUE(s.rejected_observations.empty());
  EXPECT_NEAR(s.initial_cost, start.cost, 1e-12 * start.cost);
}

TEST(Cheirality, RejectPutsNothingBehindThatWasNot) {
  Problem problem = with_points_behind(5);
  SolveOptions options;
  options.cheirality = Cheirality::reject;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable());
  EXPECT_LT(s.final_cost, s.initial_cost);
  EXPECT_TRUE(contains_all(s.behind_camera_before, evaluate(problem).behind));
  EXPECT_TRUE(s.rejected_observations.empty());
}

TEST(Cheirality, HoldOutLeavesThoseBehindOutAndListsThem) {
  Problem problem = with_points_behind(5);
  const std::vector<std::uint64_t> behind = evaluate(problem).behind;
  Problem without = problem;  // the same problem without these observations
  without.observation_image.clear();
  without.observation_point.clear();
  without.observation_xy.clear();
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (!std::binary_search(behind.begin(), behind.end(), i))
      without.add_observation(problem.observation_image[i], problem.observation_point[i],
                              problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]);

  SolveOptions options;
  options.cheirality = Cheirality::hold_out;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.rejected_observations, behind);
  options.cheirality = Cheirality::reject;
  const Summary expected = solve(without, options);
  EXPECT_DOUBLE_EQ(s.initial_cost, expected.initial_cost);
  EXPECT_DOUBLE_EQ(s.final_cost, expected.final_cost);
  EXPECT_DOUBLE_EQ(s.final_rms_px, expected.final_rms_px);
  EXPECT_EQ(problem.points, without.points);
  EXPECT_LT(s.final_cost, s.initial_cost);
}

TEST(Cheirality, MakesNoDifferenceWhereNothingIsBehind) {
  std::vector<Problem> solved(3, small_scene().start);
  SolveOptions options;
  for (int i = 0; i < 3; ++i) {
    options.cheirality = std::array{Cheirality::formula, Cheirality::reject,
                                    Cheirality::hold_out}[static_cast<std::size_t>(i)];
    EXPECT_TRUE(solve(solved[i], options).behind_camera_after.empty());
  }
  EXPECT_EQ(solved[0].points, solved[1].points);
  EXPECT_EQ(solved[0].points, solved[2].points);
}

TEST(Cheirality, APointInTheCamerasPlaneIsNoUsableStart) {
  Problem problem = small_scene().start;
  problem.poses[0].rotation = {1, 0, 0, 0};
  problem.poses[0].translation = {0, 0, 0};
  const std::uint32_t point = problem.add_point(1, 1, 0);
  problem.add_observation(0, point, 0, 0);
  const Problem before = problem;
  const Summary s = solve(problem);
  EXPECT_EQ(s.termination, Termination::no_usable_step);
  EXPECT_FALSE(s.usable());
  EXPECT_FALSE(s.words.empty());
  EXPECT_EQ(problem.points, before.points);
}

}  // namespace
}  // namespace sheaf
