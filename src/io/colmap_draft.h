// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "scene/source_files.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Ids as a file states them, which are to be unique; those in ascending or descending order, as
/// files have them as a rule, are quick.
class UniqueIds {
 public:
  bool add(std::uint64_t id);  ///< false: it was there

 private:
  std::uint64_t last_ = 0, count_ = 0;
  bool ascending_ = true, descending_ = true;
  std::vector<std::uint64_t> run_;  ///< what the run so far consisted of
  std::unordered_set<std::uint64_t> seen_;
};

/// A problem that grows as the files of a COLMAP model are read, binary or text: cameras, images
/// with their features, points with their tracks. Each call says what is wrong, as "found ...,
/// expected ...", or nothing.
class ColmapDraft {
 public:
  using Refusal = std::optional<std::string>;
  static constexpr std::uint64_t kNoPoint = std::numeric_limits<std::uint64_t>::max();

  Refusal add_camera(std::uint32_t id, const Camera& camera);
  /// `place`: line or byte, for `unmatched`.
  Refusal add_image(std::uint32_t id, const std::array<double, 7>& pose, std::uint32_t camera_id,
                    std::string name, std::uint64_t place);
  /// Of the image added last; kNoPoint: not observed.
  Refusal add_feature(double x, double y, std::uint64_t point_id);

  Refusal add_point(std::uint64_t id, const std::array<double, 3>& xyz,
                    const std::array<std::uint8_t, 3>& colour, double error_px);
  /// Of the point added last.
  Refusal add_track_element(std::uint32_t image_id, std::uint32_t feature);

  /// A feature that names a point which does not list it.
  struct Unmatched {
    std::uint64_t place;    ///< of its image
    std::uint64_t feature;  ///< its number there
    std::string refusal;
  };
  std::optional<Unmatched> unmatched() const;

  std::size_t num_images() const { return problem_.num_images(); }
  const Problem& problem() const { return problem_; }
  const SceneMetadata& metadata() const { return metadata_; }

  /// An image has another pose than the one it was added with; `stale`: by more than rounding.
  void place_image(std::uint32_t image, const Pose& pose, bool stale);
  /// Of all images; with the ids of rigs, frames and sensors.
  void set_rigs(Rigs rigs, std::vector<std::uint32_t> rig_ids, std::vector<std::uint32_t> frame_ids,
                std::vector<std::uint32_t> sensor_ids);

  /// The problem, with its metadata and what only the format can hold.
  Problem take(SourceFiles source);

 private:
  Problem problem_;
  SceneMetadata metadata_;
  std::unordered_map<std::uint32_t, std::uint32_t> camera_of_id_, image_of_id_;
  UniqueIds point_ids_;
  std::vector<std::uint64_t> feature_point_;  ///< point id, kNoPoint, or kMatched
  std::vector<std::uint64_t> places_;
  std::unordered_map<std::uint32_t, StatedPose> stated_poses_;
  bool rotations_restated_ = false;
};

}  // namespace sheaf
