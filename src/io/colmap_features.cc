// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap_parts.h"

namespace sheaf {
namespace {

/// Without a list of features: those that are observed, in the order of the observations.
void number_features(const Problem& problem, FeatureTable& table) {
  std::vector<std::uint64_t>& begin = table.begin;
  begin.assign(problem.num_images() + 1, 0);
  for (const std::uint32_t image : problem.observation_image) ++begin[image + 1];
  for (std::size_t j = 0; j < problem.num_images(); ++j) begin[j + 1] += begin[j];
  std::vector<std::uint32_t> next(problem.num_images(), 0);
  for (const std::uint32_t image : problem.observation_image)
    table.of_observation.push_back(next[image]++);
  table.xy.resize(2 * problem.num_observations());
}

void sort_by_point(const Problem& problem, FeatureTable& table) {
  table.track.assign(problem.num_points() + 1, 0);
  for (const std::uint32_t point : problem.observation_point) ++table.track[point + 1];
  for (std::size_t i = 0; i < problem.num_points(); ++i) table.track[i + 1] += table.track[i];
  std::vector<std::uint64_t> next(table.track.begin(), table.track.end() - 1);
  table.order.resize(problem.num_observations());
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    table.order[next[problem.observation_point[i]]++] = i;
}

}  // namespace

FeatureTable feature_table(const Problem& problem, const std::vector<std::uint64_t>& point_ids) {
  FeatureTable table;
  const SceneMetadata* metadata = problem.metadata.get();
  if (metadata != nullptr && !metadata->feature_begin.empty()) {
    table.begin = metadata->feature_begin;
    table.xy = metadata->feature_xy;
    table.of_observation = metadata->observation_feature;
  } else {
    number_features(problem, table);
  }
  table.point.assign(table.xy.size() / 2, ColmapDraft::kNoPoint);
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint64_t feature =
        table.begin[problem.observation_image[i]] + table.of_observation[i];
    table.point[feature] = point_ids[problem.observation_point[i]];
    table.xy[2 * feature] = problem.observation_xy[2 * i];
    table.xy[2 * feature + 1] = problem.observation_xy[2 * i + 1];
  }
  sort_by_point(problem, table);
  return table;
}

}  // namespace sheaf
