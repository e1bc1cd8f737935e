// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
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
  std::string format;  ///< as `InputFile::format` has it

  /// Of each camera those parameters that the file's own lens does not have, where its model has
  /// more than that: they are held unless something else is asked for. Or empty.
  std::vector<ParameterSet> unknown_parameters;
  /// JSON formats: what lenses are called, of each observation its feature's scale, and members of
  /// the file, of each image's object and of each lens's that problems have no place for.
  std::vector<std::string> camera_names;
  std::vector<double> feature_scales;
  std::string root_members;
  std::vector<std::string> image_members, camera_members;
  /// OpenMVG, AliceVision: the images' ids of poses, and views that were never placed: their ids
  /// and members.
  std::vector<std::uint32_t> pose_ids;
  std::vector<std::pair<std::uint32_t, std::string>> unplaced_views;
  /// OpenSfM: measurements as they were, normalised by the larger side of the image, 2 for each
  /// observation.
  std::vector<double> normalised_xy;
  /// A file beside that one which was read too, and is not to be overwritten; or empty.
  std::filesystem::path beside{};

  /// COLMAP, text only: the files as they were, so that what was not changed is written as it
  /// stood, comments and number of digits included.
  std::string cameras, images, points;
  /// COLMAP, either form: as they were, with what problems have no place for (sensors that are no
  /// cameras or have no pose, rigs and frames without images); empty when the model has none.
  std::string rigs, frames;
  std::unordered_map<std::uint32_t, StatedPose> stated_poses;  ///< COLMAP, by image id

  /// Bundler: all images of the file's list, those that were never placed included.
  std::uint32_t listed_images = 0;
  /// NVM: the radial coefficient of each image, with which its measurements were made straight, and
  /// these as they were (2 for each observation).
  std::vector<double> nvm_distortion, nvm_measured;
  /// Formats that state them: the images' centres (3 each).
  std::vector<double> centres;
  /// libmv: of the markers, 'P' (pixels) or 'N' (normalised).
  char libmv_space = 'P';
};

/// What is held of a camera where nothing else is asked for: its principal point, and what the
/// lens of its file does not have.
inline ParameterSet usually_held(const Problem& problem, std::size_t camera) {
  const ParameterSet centre = principal_point(problem.cameras[camera].model);
  const SourceFiles* source = problem.metadata ? problem.metadata->source.get() : nullptr;
  if (source == nullptr || source->unknown_parameters.size() != problem.cameras.size())
    return centre;
  return static_cast<ParameterSet>(centre | source->unknown_parameters[camera]);
}

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
