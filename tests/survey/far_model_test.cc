// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <string>

#include "io/bytes.h"
#include "scene/similarity.h"
#include "sheaf/io.h"
#include "sheaf/solve.h"
#include "survey/study_scene.h"

// Models whose own poses and points are numbers of a national grid.
namespace sheaf {
namespace {

constexpr std::array<double, 3> kFar{500000, 4650000, 300}, kNear{0, 0, 0};

/// A problem whose numbers are those of the survey's coordinates.
Problem in_coordinates(Problem problem, const std::array<double, 3>& of) {
  Similarity to{SurveyScene::kScale, {0, 1, 0, 0}, of};
  move(problem, to);
  return problem;
}

struct Ended {
  double cost = 0;
  Survey survey;
  SurveyReport report;
  Problem written;
};

/// Half a metre for positions, and six control points of 2 cm.
Ended end_of(const Problem& model, const SurveyScene& made, const Fixed& fixed,
             const std::function<void(Constraints&)>& change) {
  Constraints c = made.frame();
  c.frame.origin = made.far;
  made.add_positions(0.5, c);
  made.add_points(6, SurveyRole::control, 0.02, 5, c);
  made.add_points(4, SurveyRole::check, 0.02, 900, c);
  change(c);
  Ended out;
  out.written = in_coordinates(model, made.far);
  out.survey = place_survey(out.written, c, fixed).value();
  SolveOptions options = test::tight();
  options.fixed = fixed;
  out.cost = solve(out.written, options).final_cost;
  out.report = finish_survey(out.written, out.survey);
  return out;
}

void expect_alike(const Ended& near, const Ended& far) {
  EXPECT_NEAR(near.cost, far.cost, 1e-9 * near.cost);
  for (const auto list : {&SurveyReport::positions, &SurveyReport::control, &SurveyReport::check}) {
    const auto &a = near.report.*list, &b = far.report.*list;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].name, b[i].name);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(a[i].residual[k], b[i].residual[k], 1e-6);
        EXPECT_NEAR(a[i].adjusted[k] + kFar[k], b[i].adjusted[k], 1e-6);
      }
    }
  }
  // What is written counts from the origin, in doubles: nothing is lost on the way.
  for (std::size_t i = 0; i < near.written.points.size(); ++i)
    EXPECT_NEAR(near.written.points[i], far.written.points[i], 1e-5);
  const test::Folder folder;
  write(far.written, folder / "model/").value();
  const Problem read_back = read(folder / "model").value();
  EXPECT_EQ(evaluate(read_back).cost, evaluate(far.written).cost);
}

void expect_same_end(
    const Fixed& fixed, const std::string& words,
    const std::function<void(Constraints&)>& change = [](Constraints&) {}) {
  for (const std::uint64_t seed : {1, 2}) {
    SurveyScene made(40, seed);
    Problem model = made.scene.start;
    model.poses = made.scene.truth.poses;
    made.far = kNear;
    const Ended near = end_of(model, made, fixed, change);
    made.far = kFar;
    const Ended far = end_of(model, made, fixed, change);
    EXPECT_EQ(far.survey.frame.origin, kFar);
    EXPECT_NE(far.survey.words.at(0).find(words), std::string::npos) << far.survey.words.at(0);
    expect_alike(near, far);
  }
}

TEST(SurveyFarModel, EndsAtTheSameCost) {
  expect_same_end({}, "the model was turned, shifted and scaled by");
}

TEST(SurveyFarModel, EndsAtTheSameCostWithPosesHeld) {
  Fixed fixed;
  fixed.poses = true;
  expect_same_end(fixed, "are held: the model, which counts in the survey's coordinates, stays");
}

TEST(SurveyFarModel, EndsAtTheSameCostWithPointsHeld) {
  Fixed fixed;
  fixed.points = true;
  expect_same_end(fixed, "it is written less their origin 500000 4650000 300");
}

TEST(SurveyFarModel, EndsAtTheSameCostWithTwoPositions) {
  expect_same_end(
      {}, "2 positions and 0 control points are too few to move by: the model, which",
      [](Constraints& c) {
        c.positions.resize(2);
        std::erase_if(c.points, [](const SurveyPoint& p) { return p.role == SurveyRole::control; });
      });
}

TEST(SurveyFarModel, FarNumbersOfALocalFrameAreTold) {
  SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(0.5, c);
  for (const WorldKind kind : {WorldKind::projected, WorldKind::local}) {
    c.frame.kind = kind;
    Problem problem = made.scene.start;
    const Survey survey = place_survey(problem, c).value();
    std::string all;
    for (const std::string& words : survey.words) all += words;
    EXPECT_EQ(all.find("\"projected\"") != std::string::npos, kind == WorldKind::local) << all;
  }
}

TEST(SurveyFarModel, HeldPosesThatAreNowhereNearAreRefused) {
  SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(0.5, c);
  std::array<double, 3> off = made.far;
  off[0] += 100;
  Problem problem = in_coordinates(made.scene.start, off);
  const std::uint64_t before = state_hash(problem);
  Fixed fixed;
  fixed.poses = true;
  const Result<Survey> refused = place_survey(problem, c, fixed);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(std::string(refused.error().what()).find("is not in the frame"), std::string::npos);
  EXPECT_EQ(state_hash(problem), before);
}

}  // namespace
}  // namespace sheaf
