// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/statistics.h"

#include <gtest/gtest.h>

namespace sheaf {
namespace {

TEST(Statistics, RangeOfNoneOneAndMany) {
  EXPECT_EQ(range_of({}).max, 0);
  EXPECT_EQ(range_of({3}).median, 3);
  const Range odd = range_of({5, 1, 2});
  EXPECT_EQ(odd.min, 1);
  EXPECT_EQ(odd.median, 2);
  EXPECT_EQ(odd.max, 5);
  EXPECT_EQ(range_of({4, 1, 2, 9}).median, 3);
}

TEST(Statistics, CountsTracksImagesAndFocals) {
  Problem problem;
  problem.add_image({}, {CameraModel::bal, {500, 0, 0}});
  problem.add_image({}, {CameraModel::bal, {700, 0, 0}});
  problem.add_image({}, 1);
  for (int i = 0; i < 4; ++i) problem.add_point(i, 0, -5);
  problem.add_observation(0, 0, 0, 0);
  problem.add_observation(1, 0, 0, 0);
  problem.add_observation(2, 0, 0, 0);
  problem.add_observation(0, 1, 0, 0);
  problem.add_observation(0, 3, 0, 0);
  const Statistics statistics = statistics_of(problem);
  const std::vector<std::pair<std::uint64_t, std::uint64_t>> histogram = {{0, 1}, {1, 2}, {3, 1}};
  EXPECT_EQ(statistics.track_histogram, histogram);
  EXPECT_EQ(statistics.track.min, 0);
  EXPECT_EQ(statistics.track.median, 1);
  EXPECT_EQ(statistics.track.max, 3);
  EXPECT_EQ(statistics.mean_track, 1.25);
  EXPECT_EQ(statistics.observations_per_image.max, 3);
  EXPECT_EQ(statistics.observations_per_image.min, 1);
  EXPECT_EQ(statistics.focal_px.min, 500);
  EXPECT_EQ(statistics.focal_px.median, 600);
  EXPECT_EQ(size_bytes(problem),
            3 * sizeof(Pose) + 3 * 4 + 2 * sizeof(Camera) + 12 * 8 + 5 * (4 + 4 + 16));
}

TEST(Statistics, OfEachLensAreThoseOfItsImages) {
  Problem problem;
  problem.add_image({}, {CameraModel::bal, {500, 0, 0}});
  problem.add_image({}, {CameraModel::bal, {700, 0, 0}});
  problem.add_image({}, 1);
  problem.add_point(0, 0, -5);
  problem.add_observation(0, 0, 3, 4);
  problem.add_observation(1, 0, 0, 2);
  problem.add_observation(2, 0, 4, 0);
  const std::vector<CameraStatistics> cameras = camera_statistics(problem);
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].images, 1u);
  EXPECT_EQ(cameras[1].images, 2u);
  EXPECT_EQ(cameras[1].observations, 2u);
  EXPECT_DOUBLE_EQ(cameras[0].mean_error_px, 5);
  EXPECT_DOUBLE_EQ(cameras[1].mean_error_px, 3);
}

TEST(Statistics, AnEmptyProblemIsAllZero) {
  const Statistics statistics = statistics_of(Problem());
  EXPECT_TRUE(statistics.track_histogram.empty());
  EXPECT_EQ(statistics.mean_track, 0);
  EXPECT_EQ(size_bytes(Problem()), 0u);
}

}  // namespace
}  // namespace sheaf
