// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// A pose as a file stated it, of an image whose pose is what its frame and sensor give.
struct StatedPose {
  std::array<double, 7> numbers{};  ///< qw qx qy qz tx ty tz
  Pose placed{};                    ///< what frame and sensor gave when they were read
  bool stale = false;               ///< the two differ by more than rounding
};

/// What only one format can hold, kept for writing the same format again.
struct SourceFiles {
  std::string format;  ///< "colmap", "colmap-text", "bundler", "nvm", "libmv"

  /// COLMAP, text only: the files as they were, so that what was not changed is written as it
  /// stood, comments and number of digits included.
  std::string cameras, images, points;
  /// COLMAP, either form: as they were, with what problems have no place for (sensors that are no
  /// cameras or have no pose, rigs and frames without images); empty when the model has none.
  std::string rigs, frames;
  std::unordered_map<std::uint32_t, StatedPose> stated_poses;  ///< COLMAP, by image id

  /// Bundler: all images of the file's list, those that were never placed included.
  std::uint32_t listed_images = 0;
  /// NVM: the radial coefficient of each image, with which its measurements were made straight,
  /// these as they were (2 for each observation), and the images' centres.
  std::vector<double> nvm_distortion, nvm_measured, nvm_centres;
  /// libmv: of the markers, 'P' (pixels) or 'N' (normalised).
  char libmv_space = 'P';
};

/// Whether a file of this format would say what was read of one: nothing changed since. Then what
/// that file stated comes back as it stood, rotations that are no unit quaternions or orthonormal
/// matrices included. Of any other state these would say something else to programs that take them
/// as they are. The two forms of a COLMAP model are one format.
inline bool is_as_read(const Problem& problem, std::string_view format) {
  if (problem.metadata == nullptr || problem.metadata->source == nullptr) return false;
  const std::string& read = problem.metadata->source->format;
  const bool colmap = format.starts_with("colmap") && read.starts_with("colmap");
  return (colmap || read == format) && state_hash(problem) == problem.metadata->state_hash;
}

}  // namespace sheaf
