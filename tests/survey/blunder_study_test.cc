// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>

#include "survey/study_scene.h"

namespace sheaf {
namespace {

using test::adjusted;
using test::Normalised;
using test::StudyScene;
using test::TextbookCovariance;

/// Every twentieth position is 50 m off, each in a direction of its own.
std::set<std::string> spoil_positions(StudyScene& study, std::uint64_t seed) {
  std::set<std::string> names;
  Random random(seed, 5);
  auto& positions = study.constraints.positions;
  for (std::size_t j = 7; j < positions.size(); j += 20) {
    const Eigen::Vector3d to(random.normal(), random.normal(), random.normal());
    for (Eigen::Index k = 0; k < 3; ++k)
      positions[j].at[static_cast<std::size_t>(k)] += 50 * to.normalized()[k];
    names.insert(positions[j].image);
  }
  return names;
}

/// The names of as many residuals, worst first.
std::set<std::string> worst(const std::vector<SurveyResidual>& list, std::size_t count) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < std::min(count, list.size()); ++i)
    if (list[i].blunder) names.insert(list[i].name);
  return names;
}

TEST(SurveyBlunders, AFewPositionsOffBy50MoveNoCentreBeyondItsSigma) {
  Normalised centres;
  double worst_sigmas = 0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    StudyScene study(100, 1200, seed);
    study.add_positions(0.5, {0, -0.3, 0.1}, {LossKind::cauchy, 3});
    const std::set<std::string> wrong = spoil_positions(study, seed);
    ASSERT_EQ(wrong.size(), 5u);
    // The textbook knows of those that are right alone.
    std::erase_if(study.textbook.positions, [](const auto& p) { return p.image % 20 == 7; });
    const SurveyReport report = adjusted(study);
    EXPECT_EQ(worst(report.positions, 5), wrong) << seed;
    const TextbookCovariance covariance(study.textbook);
    for (const SurveyResidual& r : report.positions)
      for (std::size_t j = 0; j < study.textbook.images.size(); ++j) {
        if (study.made.name(j) != r.name) continue;
        const auto& image = study.textbook.images[j];
        const Eigen::Vector3d arm = image.rotation.transpose() * Eigen::Vector3d(0, -0.3, 0.1);
        const Eigen::Vector3d error = study.local_of_world(r.adjusted) - image.centre - arm;
        centres.add(error, covariance.of_centre(j));
        for (int k = 0; k < 3; ++k)
          worst_sigmas =
              std::max(worst_sigmas, std::abs(error[k]) / std::sqrt(covariance.of_centre(j)(k, k)));
      }
  }
  EXPECT_EQ(centres.count, 5u * 100 * 3);
  EXPECT_NEAR(centres.rms(), 1, 0.2);
  EXPECT_LT(worst_sigmas, 4.5);
  RecordProperty("rms_of_normalised_errors", std::to_string(centres.rms()));
  RecordProperty("worst_of_normalised_errors", std::to_string(worst_sigmas));
  RecordProperty("rms_error_m", std::to_string(centres.rms_error()));
}

TEST(SurveyBlunders, AWrongControlPointAndAWrongPositionAreTheWorstOfTheirLists) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    StudyScene study(40, 400, seed);
    study.add_positions(0.3, {0, 0, 0}, {LossKind::cauchy, 3});
    study.add_points(8, SurveyRole::control, 0.02, 0.5);
    study.constraints.points[seed % 8].at[seed % 3] += 1;
    study.constraints.positions[3 * seed].at[(seed + 1) % 3] -= 50;
    Problem problem = study.made.scene.start;
    const Survey survey = place_survey(problem, study.constraints).value();
    std::set<std::string> outliers;
    for (const SurveyOutlier& o : survey.outliers) outliers.insert(o.name);
    EXPECT_TRUE(
        outliers.contains("the position of '" + study.constraints.positions[3 * seed].image + "'"));
    solve(problem, test::tight());
    const SurveyReport report = finish_survey(problem, survey);
    EXPECT_EQ(worst(report.control, 1), std::set{study.constraints.points[seed % 8].id}) << seed;
    EXPECT_EQ(worst(report.positions, 1), std::set{study.constraints.positions[3 * seed].image})
        << seed;
  }
}

}  // namespace
}  // namespace sheaf
