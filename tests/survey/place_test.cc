// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "sheaf/solve.h"
#include "survey/survey_scene.h"

namespace sheaf {
namespace {

SolveOptions tight() {
  SolveOptions options;
  options.max_iterations = 100;
  options.tolerance = 1e-13;
  return options;
}

TEST(SurveyPlace, PositionsOffBy50DoNotBendTheModelAndAreNamed) {
  const SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(0.5, c);
  c.positions[3].at[0] += 50;
  c.positions[20].at[2] -= 50;
  for (ImagePosition& p : c.positions) p.loss = {LossKind::cauchy, 3};
  Problem problem = made.scene.start;
  const Survey survey = place_survey(problem, c).value();
  EXPECT_NEAR(survey.scale, SurveyScene::kScale, 0.5);
  ASSERT_EQ(survey.outliers.size(), 2u);
  solve(problem, tight());
  const SurveyReport report = finish_survey(problem, survey);
  ASSERT_EQ(report.positions.size(), 40u);
  // Right ones have three normal errors each, so that now and then one is named too.
  EXPECT_EQ((std::set{report.positions[0].name, report.positions[1].name}),
            (std::set{made.name(3), made.name(20)}));
  EXPECT_GT(report.positions[1].worst_sigmas, 50);
  EXPECT_LT(report.positions[2].worst_sigmas, 5);
  for (const SurveyResidual& r : report.positions)
    for (std::size_t j = 0; j < 40; ++j) {
      if (made.name(j) != r.name) continue;
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(r.adjusted[k], made.true_centre(j)[k], 0.5) << r.name;
    }
  // What the survey added is gone again.
  EXPECT_EQ(problem.num_points(), made.scene.start.num_points());
  EXPECT_EQ(problem.metadata, made.scene.start.metadata);
  EXPECT_TRUE(problem.terms.empty());
}

TEST(SurveyPlace, AControlPointOffBy1IsNamedAndCheckPointsHold) {
  const SurveyScene made;
  Constraints c = made.frame();
  made.add_points(10, SurveyRole::control, 0.02, 5, c);
  made.add_points(10, SurveyRole::check, 0.02, 900, c);
  Problem right = made.scene.start;
  const Survey survey = place_survey(right, c).value();
  solve(right, tight());
  const SurveyReport report = finish_survey(right, survey);
  ASSERT_EQ(report.control.size(), 10u);
  ASSERT_EQ(report.check.size(), 10u);
  for (const double x : report.control_rmse) EXPECT_LT(x, 0.04);
  for (const double x : report.check_rmse) EXPECT_LT(x, 0.2);

  c.points[4].at[2] += 1;
  Problem wrong = made.scene.start;
  const Survey off = place_survey(wrong, c).value();
  solve(wrong, tight());
  const SurveyReport named = finish_survey(wrong, off);
  EXPECT_EQ(named.control[0].name, c.points[4].id);
  EXPECT_TRUE(named.control[0].blunder);
}

TEST(SurveyPlace, FarAwayAndNearTheOriginEndAtTheSameCost) {
  SurveyScene made;
  double costs[2];
  for (const bool is_far : {false, true}) {
    made.far =
        is_far ? std::array<double, 3>{500000, 4650000, 300} : std::array<double, 3>{0, 0, 0};
    Constraints c = made.frame();
    made.add_positions(0.5, c);
    made.add_points(6, SurveyRole::control, 0.02, 5, c);
    Problem problem = made.scene.start;
    const Survey survey = place_survey(problem, c).value();
    EXPECT_NEAR(survey.frame.origin->at(1), made.far[1], 200);
    costs[is_far] = solve(problem, tight()).final_cost;
  }
  EXPECT_NEAR(costs[0], costs[1], 1e-9 * costs[0]);
}

TEST(SurveyPlace, AScaleBarSetsADistance) {
  const SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(2, c);
  made.add_points(2, SurveyRole::tie, 1, 5, c);
  const Vector3<double> d = [&] {
    const auto &a = c.points[0].at, &b = c.points[1].at;
    return Vector3<double>{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  }();
  c.scale_bars.push_back({c.points[0].id, c.points[1].id, std::hypot(d[0], d[1], d[2]), 0.001});
  for (SurveyPoint& point : c.points) point.marks[0].sigma_px = 0.5;
  Problem problem = made.scene.start;
  const Survey survey = place_survey(problem, c).value();
  EXPECT_EQ(problem.observation_sigma.size(), problem.num_observations());
  solve(problem, tight());
  const SurveyReport report = finish_survey(problem, survey);
  ASSERT_EQ(report.distances.size(), 1u);
  EXPECT_LT(std::abs(report.distances[0].residual), 0.003);
  EXPECT_TRUE(problem.observation_sigma.empty());
}

TEST(SurveyPlace, WhatDoesNotSetTheFrameIsToldOrRefused) {
  const SurveyScene made;
  Constraints all = made.frame();
  made.add_positions(0.5, all);
  Problem problem = made.scene.start;
  Constraints two = all;
  two.positions.resize(2);
  const Survey survey = place_survey(problem, two).value();
  EXPECT_FALSE(survey.moved);
  EXPECT_NE(survey.words.at(0).find("not determined"), std::string::npos);

  Constraints line = all;
  for (std::size_t j = 0; j < 40; ++j) line.positions[j].at = {500000.0 + double(j), 4650000, 300};
  problem = made.scene.start;
  const Result<Survey> refused = place_survey(problem, line);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(std::string(refused.error().what()).find("lie in a line"), std::string::npos);
  EXPECT_EQ(state_hash(problem), state_hash(made.scene.start));

  Fixed fixed;
  fixed.poses = true;
  const Result<Survey> held = place_survey(problem, all, fixed);
  ASSERT_FALSE(held.ok());
  EXPECT_NE(std::string(held.error().what()).find("poses or points are held"), std::string::npos);

  Constraints unknown = all;
  unknown.positions[1].image = "nowhere.jpg";
  problem = made.scene.start;
  const Survey without = place_survey(problem, unknown).value();
  ASSERT_EQ(without.unused.size(), 1u);
  EXPECT_EQ(without.unused[0], "survey.json:2: the model has no image 'nowhere.jpg'");
}

}  // namespace
}  // namespace sheaf
