// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <string>

#include "survey/study_scene.h"

namespace sheaf {
namespace {

using test::adjusted;
using test::Normalised;
using test::StudyScene;
using test::TextbookCovariance;

constexpr std::uint64_t kScenes = 40;
constexpr std::size_t kChecks = 8;

class SurveyStudy : public testing::Test {
 protected:
  /// Check points of so many scenes, each with what `measure` adds.
  Normalised check_points(const std::function<void(StudyScene&)>& measure) {
    Normalised sum;
    for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
      StudyScene study(24, 300, seed);
      measure(study);
      study.add_points(kChecks, SurveyRole::check, 1, 0.7);
      const SurveyReport report = adjusted(study);
      const TextbookCovariance covariance(study.textbook);
      for (const StudyScene::Check& check : study.checks)
        for (const SurveyResidual& r : report.check)
          if (r.name == check.id)
            sum.add(study.local_of_world(r.adjusted) - check.truth,
                    covariance.of_triangulated(check.truth, check.sights));
    }
    return sum;
  }

  void expect_as_the_textbook_says(const Normalised& found) {
    EXPECT_EQ(found.count, kScenes * kChecks * 3);
    EXPECT_NEAR(found.rms(), 1, 0.15);
    RecordProperty("rms_of_normalised_errors", std::to_string(found.rms()));
    RecordProperty("rms_error_m", std::to_string(found.rms_error()));
    RecordProperty("rms_sigma_m", std::to_string(found.rms_sigma()));
    RecordProperty("coordinates", std::to_string(found.count));
  }
};

TEST_F(SurveyStudy, CheckPointsStrayAsTheCovarianceSaysWithPositionsAndControl) {
  expect_as_the_textbook_says(check_points([](StudyScene& study) {
    study.add_positions(0.3, {0.1, -0.4, 0.2});
    study.add_points(5, SurveyRole::control, 0.02, 0.5);
  }));
}

TEST_F(SurveyStudy, CheckPointsStrayAsTheCovarianceSaysWithControlAlone) {
  expect_as_the_textbook_says(
      check_points([](StudyScene& study) { study.add_points(6, SurveyRole::control, 0.03, 1); }));
}

TEST_F(SurveyStudy, CheckPointsStrayAsTheCovarianceSaysWithPositionsAndAScaleBar) {
  expect_as_the_textbook_says(check_points([](StudyScene& study) {
    study.add_positions(0.5, {0, 0, 0});
    study.add_points(2, SurveyRole::tie, 1, 0.5);
    study.add_bar(0.005);
  }));
}

}  // namespace
}  // namespace sheaf
