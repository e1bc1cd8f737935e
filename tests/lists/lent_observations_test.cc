// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/lent_observations.h"

#include <gtest/gtest.h>

#include <utility>

#include "platform/parallel.h"
#include "scene/behind.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem scene() {
  SceneOptions options;
  options.images = 9;
  options.points = 5000;
  options.mean_track = 4;
  Problem problem = generate(options).value().start;
  problem.add_point(1, 2, 3);  // that nobody sees
  return problem;
}

void expect_same(const Problem& a, const Problem& b) {
  EXPECT_EQ(a.observation_image, b.observation_image);
  EXPECT_EQ(a.observation_point, b.observation_point);
  EXPECT_EQ(a.observation_xy, b.observation_xy);
}

TEST(LentObservations, ComeBackAsTheyWere) {
  const Problem before = scene();
  for (int count : {1, 3}) {
    Threads threads(count);
    Problem problem = before;
    const Batches batches = arrange(problem, {}, threads);
    ASSERT_TRUE(LentObservations::possible(problem, batches, threads));
    {
      const LentObservations lent(problem, batches, threads);
      EXPECT_EQ(problem.num_observations(), 0u);
      EXPECT_EQ(problem.observation_xy.capacity(), 0u);
    }
    expect_same(problem, before);
  }
}

TEST(LentObservations, ComeBackTwiceSeenAndWithoutSomePoints) {
  Problem before = scene();
  before.points.resize(before.points.size() - 3);
  const std::uint32_t last = static_cast<std::uint32_t>(before.num_points() - 1);
  before.add_observation(8, last, 1, 2);
  before.add_observation(8, last, 3, 4);
  Threads threads(2);
  Problem problem = before;
  const Batches batches = arrange(problem, {}, threads);
  ASSERT_TRUE(LentObservations::possible(problem, batches, threads));
  { const LentObservations lent(problem, batches, threads); }
  expect_same(problem, before);
}

TEST(LentObservations, StayWhereTheirOrderWouldBeLost) {
  Threads threads(2);
  Problem problem = scene();
  std::vector<std::uint8_t> skip(problem.num_observations(), 0);
  skip[7] = 1;
  EXPECT_FALSE(LentObservations::possible(problem, arrange(problem, skip, threads), threads));
  std::swap(problem.observation_point.front(), problem.observation_point.back());
  EXPECT_FALSE(LentObservations::possible(problem, arrange(problem, {}, threads), threads));
}

TEST(BehindCamera, ListsWhatTheEvaluationLists) {
  Problem problem = scene();
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    if (i / 3 % 5 == 0) problem.points[i] *= 100;  // beyond the cameras of its side
  Threads threads(2);
  const std::vector<std::uint64_t> expected = evaluate(problem).behind;
  ASSERT_FALSE(expected.empty());
  EXPECT_EQ(behind_camera(problem, threads), expected);
}

}  // namespace
}  // namespace sheaf
