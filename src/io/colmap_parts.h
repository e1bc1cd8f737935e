// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/colmap.h"
#include "io/colmap_draft.h"

namespace sheaf {

/// The parts of reading a COLMAP model: each adds one file to the draft, or says what is wrong.
std::optional<Error> read_cameras_binary(std::string_view bytes, const std::string& name,
                                         ColmapDraft& draft);
std::optional<Error> read_images_binary(std::string_view bytes, const std::string& name,
                                        ColmapDraft& draft);
std::optional<Error> read_points_binary(std::string_view bytes, const std::string& name,
                                        ColmapDraft& draft);
std::optional<Error> read_cameras_text(std::string_view text, const std::string& name,
                                       ColmapDraft& draft);
std::optional<Error> read_images_text(std::string_view text, const std::string& name,
                                      ColmapDraft& draft);
std::optional<Error> read_points_text(std::string_view text, const std::string& name,
                                      ColmapDraft& draft);

/// The features of each image, observed or not, and what they observe.
struct FeatureTable {
  std::vector<std::uint64_t> begin;  ///< images + 1
  std::vector<double> xy;
  std::vector<std::uint64_t> point;  ///< id, or ColmapDraft::kNoPoint
  std::vector<std::uint32_t> of_observation;

  /// Observations by point; those of point i are order[track[i]] to order[track[i + 1] - 1].
  std::vector<std::uint64_t> track, order;
};
FeatureTable feature_table(const Problem& problem, const std::vector<std::uint64_t>& point_ids);

}  // namespace sheaf
