// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/subset.h"

#include <algorithm>
#include <cstddef>
#include <memory>

#include "scene/renumber.h"

namespace sheaf {
namespace {

/// Counts of observations become the numbers of the points that have enough of them.
void number_points(std::vector<std::uint32_t>& counts, std::uint32_t least_track) {
  std::uint32_t next = 0;
  for (std::uint32_t& count : counts) count = count < least_track ? kGonePoint : next++;
}

}  // namespace

std::vector<std::uint32_t> keep_observations(Problem& problem, std::vector<bool>& kept,
                                             std::uint32_t least_track) {
  std::vector<std::uint32_t> numbers(problem.num_points(), 0);
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) ++numbers[problem.observation_point[i]];
  number_points(numbers, least_track);
  for (std::size_t i = 0; i < kept.size(); ++i)
    kept[i] = kept[i] && numbers[problem.observation_point[i]] != kGonePoint;

  const auto point = [&](std::size_t i) { return numbers[i] != kGonePoint; };
  const auto observation = [&](std::size_t i) { return bool(kept[i]); };
  shorten(problem.points, 3, point);
  shorten(problem.observation_image, 1, observation);
  shorten(problem.observation_point, 1, observation);
  for (std::uint32_t& p : problem.observation_point) p = numbers[p];
  shorten(problem.observation_xy, 2, observation);
  shorten(problem.observation_sigma, 1, observation);
  renumber({{}, {}, numbers}, problem.terms);
  if (problem.metadata == nullptr) return numbers;
  auto metadata = std::make_shared<SceneMetadata>(*problem.metadata);
  shorten(metadata->point_ids, 1, point);
  shorten(metadata->point_colours, 1, point);
  shorten(metadata->point_errors_px, 1, point);
  shorten(metadata->observation_feature, 1, observation);
  problem.metadata = std::move(metadata);
  return numbers;
}

}  // namespace sheaf
