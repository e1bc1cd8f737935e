// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/batches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <tuple>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

using Observation = std::tuple<std::uint32_t, std::uint32_t, double, double>;

std::vector<Observation> listed(const Problem& p, const std::vector<std::uint8_t>& skip = {}) {
  std::vector<Observation> out;
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (skip.empty() || skip[i] == 0)
      out.emplace_back(p.observation_point[i], p.observation_image[i], p.observation_xy[2 * i],
                       p.observation_xy[2 * i + 1]);
  std::sort(out.begin(), out.end());
  return out;
}

/// What the lanes of the batches hold, masked ones left out.
std::vector<Observation> listed(const Batches& batches) {
  std::vector<Observation> out;
  for (std::size_t g = 0; g < batches.groups.size(); ++g) {
    const Batches::Group& group = batches.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        out.emplace_back(batches.lane_point[8 * g + l], batches.image[8 * b + l],
                         batches.xy[16 * b + l], batches.xy[16 * b + 8 + l]);
  }
  std::sort(out.begin(), out.end());
  return out;
}

void expect_well_formed(const Batches& batches) {
  std::uint64_t next = 0;
  std::uint32_t longest = 0, previous = 0;
  std::vector<std::uint32_t> points;
  ASSERT_EQ(batches.lane_point.size(), 8 * batches.groups.size());
  for (std::size_t g = 0; g < batches.groups.size(); ++g) {
    const Batches::Group& group = batches.groups[g];
    EXPECT_EQ(group.first_batch, next);
    next += group.track;
    EXPECT_GE(group.track, std::max(1u, previous));  // sorted by track length
    previous = group.track;
    longest = std::max(longest, group.track);
    ASSERT_GE(group.lanes, 1u);
    ASSERT_LE(group.lanes, 8u);
    for (std::uint32_t l = 0; l < 8; ++l) {
      if (l < group.lanes)
        points.push_back(batches.lane_point[8 * g + l]);
      else
        EXPECT_EQ(batches.lane_point[8 * g + l], batches.lane_point[8 * g]);
    }
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = group.lanes; l < 8; ++l) {  // masked lanes repeat the first
        EXPECT_EQ(batches.image[8 * b + l], batches.image[8 * b]);
        EXPECT_EQ(batches.xy[16 * b + l], batches.xy[16 * b]);
        EXPECT_EQ(batches.xy[16 * b + 8 + l], batches.xy[16 * b + 8]);
      }
    for (std::uint32_t o = 1; o < group.track; ++o)  // a point's images rise along its track
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        EXPECT_LE(batches.image[8 * (group.first_batch + o - 1) + l],
                  batches.image[8 * (group.first_batch + o) + l]);
  }
  EXPECT_EQ(batches.num_batches(), next);
  EXPECT_EQ(batches.image.size(), 8 * next);
  EXPECT_EQ(batches.xy.size(), 16 * next);
  EXPECT_EQ(batches.longest_track, longest);
  std::sort(points.begin(), points.end());
  EXPECT_EQ(std::adjacent_find(points.begin(), points.end()), points.end()) << "a point twice";
  for (std::uint64_t b = 0; b < next; ++b) {
    const std::uint32_t* image = &batches.image[8 * b];
    const bool same = std::all_of(image, image + 8, [&](auto i) { return i == image[0]; });
    EXPECT_EQ(batches.uniform[b], same ? static_cast<std::int32_t>(image[0]) : -1);
  }
}

Problem scene(std::uint64_t images, std::uint64_t points) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  return generate(options).value().start;
}

/// The same observations in another order.
Problem shuffled(const Problem& p, unsigned seed) {
  std::vector<std::size_t> order(p.num_observations());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  Problem out = p;
  for (std::size_t i = 0; i < order.size(); ++i) {
    out.observation_image[i] = p.observation_image[order[i]];
    out.observation_point[i] = p.observation_point[order[i]];
    out.observation_xy[2 * i] = p.observation_xy[2 * order[i]];
    out.observation_xy[2 * i + 1] = p.observation_xy[2 * order[i] + 1];
  }
  return out;
}

template <class Sequence>
std::vector<double> numbers(const Sequence& s) {
  return {s.begin(), s.end()};
}

TEST(Batches, HoldEveryObservationOnce) {
  for (std::uint64_t points : {20, 57, 1000}) {
    const Problem problem = scene(13, points);
    const Batches batches = arrange(problem);
    expect_well_formed(batches);
    EXPECT_EQ(batches.observations, problem.num_observations());
    EXPECT_EQ(listed(batches), listed(problem));
  }
}

TEST(Batches, DoNotDependOnTheOrderOfTheObservations) {
  const Problem problem = scene(13, 700);
  const Batches expected = arrange(shuffled(problem, 1));
  for (const Problem& p : {problem, shuffled(problem, 2), shuffled(problem, 3)}) {
    const Batches batches = arrange(p);
    expect_well_formed(batches);
    EXPECT_EQ(batches.lane_point, expected.lane_point);
    EXPECT_EQ(numbers(batches.image), numbers(expected.image));
    EXPECT_EQ(numbers(batches.uniform), numbers(expected.uniform));
    EXPECT_EQ(numbers(batches.xy), numbers(expected.xy));
  }
}

TEST(Batches, LeaveOutWhatIsSkipped) {
  const Problem problem = scene(13, 700);
  std::vector<std::uint8_t> skip(problem.num_observations(), 0);
  for (std::size_t i = 0; i < skip.size(); ++i) skip[i] = i % 3 == 1;
  for (std::size_t i = 0; i < skip.size(); ++i)  // one point loses all it has
    if (problem.observation_point[i] == 17) skip[i] = 1;
  const Batches batches = arrange(problem, skip);
  expect_well_formed(batches);
  EXPECT_EQ(batches.observations,
            static_cast<std::uint64_t>(std::count(skip.begin(), skip.end(), 0)));
  EXPECT_EQ(listed(batches), listed(problem, skip));

  std::fill(skip.begin(), skip.end(), 1);
  EXPECT_EQ(arrange(problem, skip).num_batches(), 0u);
  std::fill(skip.begin(), skip.end(), 0);
  EXPECT_EQ(numbers(arrange(problem, skip).xy), numbers(arrange(problem).xy));
}

TEST(Batches, KeepAPointThatOneImageSeesTwice) {
  Problem problem = scene(5, 60);
  problem.add_observation(problem.observation_image[0], problem.observation_point[0], 1, 2);
  problem.add_observation(problem.observation_image[0], problem.observation_point[0], 1, 2);
  const Batches batches = arrange(problem);
  expect_well_formed(batches);
  EXPECT_EQ(listed(batches), listed(problem));
}

TEST(Batches, LeaveOutPointsThatNobodySees) {
  Problem problem = scene(5, 60);
  const std::uint32_t unseen = problem.add_point(1, 2, 3);
  const Batches batches = arrange(problem);
  EXPECT_EQ(std::count(batches.lane_point.begin(), batches.lane_point.end(), unseen), 0);
}

TEST(Batches, MostSeeOneImageInAllLanes) {
  // What the sort by images is for: points seen by the same images stand side by side.
  const Batches batches = arrange(shuffled(scene(8, 20000), 4));
  const auto uniform = static_cast<double>(
      std::count_if(batches.uniform.begin(), batches.uniform.end(), [](auto i) { return i >= 0; }));
  EXPECT_GT(uniform, 0.5 * static_cast<double>(batches.num_batches()));
}

TEST(Batches, OneImageAndTracksBeyondTheSortKey) {
  Problem problem;
  problem.add_image({}, Camera{});
  for (int j = 0; j < 11; ++j) problem.add_point(j, 0, -5);
  // Longer than the 2^20 - 1 that the key can tell apart: put in order of length all the same.
  const std::uint32_t beyond = (1u << 20) + 5;
  for (std::uint32_t i = 0; i < beyond + 3; ++i) problem.add_observation(0, 4, i, 0);
  for (std::uint32_t i = 0; i < beyond; ++i) problem.add_observation(0, 7, i, 1);
  for (std::uint32_t j : {1u, 2u, 3u}) problem.add_observation(0, j, 0, 0);
  const Batches batches = arrange(problem);
  ASSERT_EQ(batches.groups.size(), 3u);
  EXPECT_EQ(batches.groups[0].lanes, 3u);
  EXPECT_EQ(batches.groups[1].track, beyond);
  EXPECT_EQ(batches.groups[2].track, beyond + 3);
  EXPECT_EQ(batches.longest_track, beyond + 3);
  EXPECT_EQ(listed(batches), listed(problem));
}

}  // namespace
}  // namespace sheaf
