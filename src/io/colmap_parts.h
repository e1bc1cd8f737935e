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

/// A moment at which a rig took its images.
struct RigFrame {
  std::uint32_t rig = 0;
  std::uint64_t pose_begin = 0, pose_end = 0;  ///< where its seven numbers stand in the file
  std::vector<std::uint64_t> images;           ///< ids
  std::uint32_t camera = 0;                    ///< id of the sensor that took the first of them
};

/// What Sheaf looks at of rigs and frames: enough to know that they are whole, and where poses are.
struct ColmapRigs {
  std::vector<std::array<std::uint32_t, 2>> references;  ///< rig id, id of its reference camera
  std::vector<RigFrame> frames;
};
Result<ColmapRigs> parse_rigs(const ColmapFiles& files);

/// The frames of a model whose poses changed: each has the pose of its one image. Nothing where
/// some frame has several, or one that is not its rig's reference: then no pose of the frame
/// follows from theirs.
std::optional<std::string> frames_with_poses(const ColmapFiles& files, const Problem& problem);

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
