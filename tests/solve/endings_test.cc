// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/endings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "sheaf/io.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

Problem case_problem(const std::string& name) { return read_file(case_file(name)).value().problem; }

bool says(const std::string& words, const std::string& part) {
  return words.find(part) != std::string::npos;
}

TEST(Endings, NothingFreeIsSaid) {
  Problem problem = small_scene().start;
  const Problem before = problem;
  SolveOptions options;
  options.fixed.points = options.fixed.poses = options.fixed.intrinsics = true;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::nothing_free) << s.words;
  EXPECT_TRUE(s.usable());
  EXPECT_NEAR(s.final_cost, evaluate(before).cost, 1e-10 * s.final_cost);
  EXPECT_EQ(problem.points, before.points);
}

TEST(Endings, ZeroWeightsAreNoConvergence) {
  Problem problem = small_scene().start;
  SolveOptions options;
  options.loss = Tukey{1e-3};
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::zero_weights) << s.words;
  EXPECT_FALSE(s.usable());
  EXPECT_TRUE(says(s.words, "0.001"));
}

TEST(Endings, APointInACamerasPlaneIsNamedWithTheRemedy) {
  Problem problem = case_problem("z-zero.txt");
  const Summary s = solve(problem);
  EXPECT_EQ(s.termination, Termination::no_usable_step);
  EXPECT_TRUE(says(s.words, "observation 176,")) << s.words;
  EXPECT_TRUE(says(s.words, "Z = 0")) << s.words;
  EXPECT_TRUE(says(s.words, "hold-out")) << s.words;
  SolveOptions options;
  options.cheirality = Cheirality::hold_out;
  options.max_iterations = 100;
  const Summary held_out = solve(problem, options);
  EXPECT_NEAR(held_out.final_cost, 18.32023299, 1e-6);
  EXPECT_EQ(held_out.rejected_observations, std::vector<std::uint64_t>{176});
}

TEST(Endings, APointAtACentreIsNamedOrRecovered) {
  Problem problem = case_problem("point-at-origin.txt");
  const Summary origin = solve(problem);
  EXPECT_EQ(origin.termination, Termination::no_usable_step);
  EXPECT_TRUE(says(origin.words, "at the camera's centre")) << origin.words;
  problem = case_problem("point-at-centre.txt");
  EXPECT_LT(solve(problem).final_cost, 12.26) << "from 3e12";
}

TEST(Endings, AnAbsurdMeasurementIsNamedWithoutManyTries) {
  Problem problem = small_scene().start;
  problem.observation_xy[2 * 40] = 1e100;
  const Summary s = solve(problem);
  EXPECT_EQ(s.termination, Termination::drowned) << s.words;
  EXPECT_TRUE(says(s.words, "observation 40,")) << s.words;
  EXPECT_TRUE(s.usable());
  EXPECT_LE(s.iterations.size(), 6u);
  EXPECT_LE(s.final_cost, s.initial_cost);
}

TEST(Endings, ManyLargeResidualsDrownNobody) {
  Threads threads(2);
  const Problem problem = small_scene().start;
  EXPECT_FALSE(drowning_observation(problem, {}, {}, threads).has_value());
  Problem one = problem;
  one.observation_xy[8] += 1e12;
  EXPECT_EQ(drowning_observation(one, {}, {}, threads), std::optional<std::uint64_t>(4));
  one.observation_xy[9] += 1e12;
  one.observation_xy[20] += 1e12;
  EXPECT_FALSE(drowning_observation(one, {}, {}, threads).has_value());
}

}  // namespace
}  // namespace sheaf
