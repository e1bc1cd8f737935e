// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/clusters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace sheaf {
namespace {

/// Streets of images that see points in common with the next `reach`, one beside the other.
Problem streets(std::uint32_t count, std::uint32_t images, std::uint32_t reach) {
  Problem p;
  for (std::uint32_t i = 0; i < count * images; ++i) {
    p.poses.push_back({});
    p.image_camera.push_back(i);
    p.cameras.push_back({});
  }
  for (std::uint32_t s = 0; s < count; ++s)
    for (std::uint32_t i = 0; i + reach < images; ++i) {
      const std::uint32_t point = p.add_point(0, 0, 1);
      for (std::uint32_t k = 0; k <= reach; ++k) p.add_observation(s * images + i + k, point, 0, 0);
    }
  return p;
}

Clusters cluster(const Problem& p, const Fixed& fixed, std::size_t each) {
  const Batches batches = arrange(p);
  Threads threads(2);
  return cluster_images(Covisibility(batches, p.num_images(), threads), number_columns(p, fixed),
                        each);
}

TEST(Clusters, AreStretchesOfAStreet) {
  const Problem p = streets(1, 200, 4);
  const Clusters c = cluster(p, {}, 10);
  EXPECT_GE(c.count, 16);
  EXPECT_LE(c.count, 24);
  std::vector<int> members(c.count, 0), first(c.count, 200), last(c.count, -1);
  for (int i = 0; i < 200; ++i) {
    const std::int32_t to = c.of_image[i];
    ASSERT_TRUE(to >= 0 && to < c.count) << i;
    ++members[to];
    first[to] = std::min(first[to], i);
    last[to] = i;
  }
  for (std::int32_t k = 0; k < c.count; ++k) {
    EXPECT_GE(members[k], 4);
    EXPECT_LE(members[k], 16);
    EXPECT_LE(last[k] - first[k], 20) << "a cluster that is no stretch";
  }
}

TEST(Clusters, LeaveHeldPosesOutAndStayWithinConnectedParts) {
  const Problem p = streets(3, 40, 3);
  Fixed fixed;
  fixed.pose_ids = {0, 17, 45};
  const Clusters c = cluster(p, fixed, 8);
  std::vector<std::set<int>> parts(c.count);
  for (std::uint32_t i = 0; i < 120; ++i) {
    const bool held = i == 0 || i == 17 || i == 45;
    ASSERT_EQ(c.of_image[i] == Clusters::kNone, held) << i;
    if (!held) parts[c.of_image[i]].insert(static_cast<int>(i / 40));
  }
  for (const auto& part : parts) EXPECT_EQ(part.size(), 1u);
}

TEST(Clusters, AnImageThatSharesNothingIsAlone) {
  Problem p = streets(1, 20, 2);
  const std::uint32_t lonely = static_cast<std::uint32_t>(p.num_images());
  p.poses.push_back({});
  p.image_camera.push_back(lonely);
  p.cameras.push_back({});
  p.add_observation(lonely, p.add_point(0, 0, 1), 0, 0);
  const Clusters c = cluster(p, {}, 5);
  EXPECT_EQ(std::count(c.of_image.begin(), c.of_image.end(), c.of_image[lonely]), 1);
}

TEST(Clusters, PairsThatSeeAPointInCommonAreNumberedOnce) {
  const Problem p = streets(2, 40, 3);
  const Batches batches = arrange(p);
  const Clusters c = cluster(p, {}, 8);
  std::set<std::pair<std::int32_t, std::int32_t>> expected;
  for (std::size_t a = 0; a < p.num_observations(); ++a)
    for (std::size_t b = 0; b < p.num_observations(); ++b) {
      if (p.observation_point[a] != p.observation_point[b]) continue;
      const std::int32_t row = c.of_image[p.observation_image[a]],
                         column = c.of_image[p.observation_image[b]];
      if (row >= column) expected.insert({row, column});
    }
  Threads threads(2);
  const std::vector<std::int32_t> numbers = number_cluster_pairs(batches, c, threads);
  EXPECT_EQ(count_cluster_pairs(numbers), expected.size());
  std::set<std::int32_t> seen;
  for (const auto& [row, column] : expected) seen.insert(numbers[cluster_pair(row, column)]);
  EXPECT_EQ(seen.size(), expected.size());
  EXPECT_EQ(*seen.begin(), 0);
}

}  // namespace
}  // namespace sheaf
