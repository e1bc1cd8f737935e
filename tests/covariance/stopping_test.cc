// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "platform/clock.h"
#include "sheaf/covariance.h"
#include "sheaf/scene.h"

// A covariance that is asked to end, or is out of time: it ends soon, tells nothing, and is no
// error.
namespace sheaf {
namespace {

/// Every point is seen by a half of the images, so that nearly all of these are coupled.
Problem crowd(std::uint64_t images, std::uint64_t points) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  options.mean_track = static_cast<double>(images) / 2;
  return generate(options).value().truth;
}

void expect_nothing(const Covariance& found) {
  EXPECT_TRUE(found.poses.empty() && found.centres.empty() && found.lenses.empty());
  EXPECT_TRUE(found.points.empty() && found.observations.empty() && found.words.empty());
  EXPECT_GE(found.seconds, 0);
}

CovarianceOptions by(CovarianceSolver solver) {
  CovarianceOptions options;
  options.solver = solver;
  if (solver == CovarianceSolver::conjugate_gradients) {
    options.image_ids = {0, 1};
    options.points = false;
  }
  return options;
}

constexpr CovarianceSolver kSolvers[] = {CovarianceSolver::factor,
                                         CovarianceSolver::conjugate_gradients};

TEST(CovarianceStops, WhereItWasAskedBefore) {
  const Problem problem = crowd(6, 100);
  for (const CovarianceSolver solver : kSolvers) {
    CovarianceOptions options = by(solver);
    StopSource source;
    options.stop = source.get_token();
    ASSERT_EQ(covariance(problem, options).value().ending, CovarianceEnding::whole);
    source.request_stop();
    const Covariance found = covariance(problem, options).value();
    EXPECT_EQ(found.ending, CovarianceEnding::stopped);
    expect_nothing(found);
  }
}

/// At any place: the limit of time goes through the whole of the work, and the end of what is not
/// cut short is the same.
TEST(CovarianceStops, AtAnyTimeOfTheWork) {
  const Problem problem = crowd(24, 300);
  for (const CovarianceSolver solver : kSolvers) {
    CovarianceOptions options = by(solver);
    options.threads = 2;
    options.observations = solver == CovarianceSolver::factor;
    const Covariance whole = covariance(problem, options).value();
    ASSERT_EQ(whole.ending, CovarianceEnding::whole);
    int cut = 0;
    for (int k = 1; k <= 8; ++k) {
      options.time_limit_s = whole.seconds * k / 8;
      const Covariance found = covariance(problem, options).value();
      if (found.ending == CovarianceEnding::whole) {
        EXPECT_EQ(found.poses, whole.poses);
        continue;
      }
      ++cut;
      EXPECT_EQ(found.ending, CovarianceEnding::time_limit);
      EXPECT_LT(found.seconds, options.time_limit_s + 0.5);
      expect_nothing(found);
    }
    EXPECT_GT(cut, 2);
  }
}

TEST(CovarianceStops, WithinASecondOfTheAsking) {
  const Problem problem = crowd(200, 1500);
  for (const CovarianceSolver solver : kSolvers) {
    CovarianceOptions options = by(solver);
    StopSource source;
    options.stop = source.get_token();
    double asked_s = 0;
    const Stopwatch clock;
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
      asked_s = clock.seconds();
      source.request_stop();
    });
    const Covariance found = covariance(problem, options).value();
    const double ended_s = clock.seconds();
    other.join();
    if (found.ending == CovarianceEnding::whole) continue;  // a machine that is quicker than this
    EXPECT_EQ(found.ending, CovarianceEnding::stopped);
    EXPECT_LT(ended_s, asked_s + 1);
  }
}

TEST(CovarianceStops, LimitsThatAreNoneAreRefused) {
  const Problem problem = crowd(4, 50);
  for (const double limit : {0.0, -1.0, std::nan("")}) {
    CovarianceOptions options;
    options.time_limit_s = limit;
    EXPECT_EQ(covariance(problem, options).error().code(), ErrorCode::usage) << limit;
  }
}

}  // namespace
}  // namespace sheaf
