// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/behind.h"
#include "solve/lens_problems.h"
#include "solve/scenes.h"
#include "starts/intersection.h"
#include "starts/resection.h"

namespace sheaf::test {
namespace {

bool never() { return false; }

double cost(const Sights& sights, const Estimate& state) {
  double sum = 0;
  for (std::size_t i = 0; i < sights.num_images(); ++i)
    sum += fit_of_image(sights, i, state, {}).cost;
  return sum;
}

TEST(Starts, FitsAgreeWithThePlainEvaluation) {
  for (CameraModel model : all_models()) {
    const Problem problem = disturbed({ordinary(model)}, 5, 60, 3);
    EXPECT_NEAR(cost(Sights(problem, {}), estimate_of(problem)), evaluate(problem).cost,
                1e-10 * evaluate(problem).cost)
        << to_string(model);
  }
}

TEST(Starts, PointsAreIntersectedFromAnywhere) {
  Threads threads(2);
  for (CameraModel model : all_models()) {
    const Problem problem = disturbed({ordinary(model)}, 6, 80, 5);
    const Sights sights(problem, {});
    Estimate good = estimate_of(problem);
    intersect(sights, {}, never, threads, good);
    Estimate lost = estimate_of(problem);
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    for (double& x : lost.points) x = normal(random);
    intersect(sights, {}, never, threads, lost);
    EXPECT_NEAR(cost(sights, lost), cost(sights, good), 1e-3 * cost(sights, good))
        << to_string(model);
  }
}

TEST(Starts, TurnedAndDistortedImagesAreResected) {
  Threads threads(2);
  const Scene scene = small_scene();
  const Problem& problem = scene.start;
  const Sights sights(problem, {});
  const FreeImages free = free_images(problem, {});
  Estimate good = estimate_of(scene.truth);
  Estimate lost = good;
  for (std::size_t i = 0; i < lost.poses.size(); ++i) {
    Pose& pose = lost.poses[i];
    turn_about_centre(pose, {0.5, i % 2 ? 0.7 : -0.7, 0.4});
    if (i % 3 == 0) lost.cameras[i].parameters[1] += 50;
  }
  resect(sights, free, {}, never, threads, good);
  const double before = cost(sights, lost);
  resect(sights, free, {}, never, threads, lost);
  EXPECT_LT(cost(sights, lost), 1.01 * cost(sights, good)) << "from " << before;
}

TEST(Starts, WhatIsHeldStays) {
  Threads threads(1);
  const Problem problem = small_scene().start;
  Fixed fixed;
  fixed.pose_ids = {2};
  fixed.camera_ids = {2, 3};
  fixed.f = true;
  Estimate state = estimate_of(problem);
  resect(Sights(problem, {}), free_images(problem, fixed), {}, never, threads, state);
  EXPECT_EQ(state.poses[2].rotation, problem.poses[2].rotation);
  EXPECT_EQ(state.poses[2].translation, problem.poses[2].translation);
  EXPECT_NE(state.poses[3].translation, problem.poses[3].translation);
  for (std::size_t c : {2u, 3u})
    EXPECT_EQ(state.cameras[c].parameters, problem.cameras[c].parameters);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c)
    EXPECT_EQ(state.cameras[c].parameters[0], problem.cameras[c].parameters[0]);
  EXPECT_NE(state.cameras[4].parameters[1], problem.cameras[4].parameters[1]);
}

TEST(Starts, SkippedObservationsCountForNothing) {
  Problem problem = small_scene().start;
  std::vector<std::uint8_t> skip(problem.num_observations(), 0);
  for (std::size_t i = 0; i < skip.size(); i += 40) {
    skip[i] = 1;
    problem.observation_xy[2 * i] = 1e30;
  }
  const Sights sights(problem, skip);
  EXPECT_LT(cost(sights, estimate_of(problem)), 1e12);
}

TEST(Starts, ThreadsChangeNoBit) {
  const Problem problem = small_scene().start;
  const Sights sights(problem, {});
  Estimate one = estimate_of(problem), many = one;
  for (auto [state, count] : {std::pair{&one, 1}, std::pair{&many, 3}}) {
    Threads threads(count);
    resect(sights, free_images(problem, {}), {}, never, threads, *state);
    intersect(sights, {}, never, threads, *state);
  }
  EXPECT_EQ(one.points, many.points);
  for (std::size_t i = 0; i < one.poses.size(); ++i)
    EXPECT_EQ(one.poses[i].translation, many.poses[i].translation);
}

}  // namespace
}  // namespace sheaf::test
