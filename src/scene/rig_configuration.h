// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// A camera of a rig: whose images it took, and where it sits.
struct RigCamera {
  std::string image_prefix;  ///< of the names of its images; the rest of a name tells the frame
  bool reference = false;    ///< the rig's origin: one of its cameras
  std::optional<Pose> cam_from_rig;  ///< else it is taken from the poses of the images
};

/// Which images move as one, as COLMAP's rig_configurator has it.
struct RigConfiguration {
  std::vector<RigCamera> cameras;
};

/// How far the poses that images had stray from what their rig says, in the frames that have the
/// image and one to compare it with.
struct SensorSpread {
  std::uint32_t sensor = 0;  ///< of Problem::rigs
  std::string image_prefix;
  bool reference = false;
  bool stated = false;       ///< the configuration had the pose
  std::uint32_t images = 0;  ///< of the sensor
  std::uint32_t frames = 0;  ///< compared
  double median_rotation_rad = 0, max_rotation_rad = 0;
  double median_translation = 0, max_translation = 0;  ///< of centres in the rig, scene units
};

/// What came of a configuration.
struct RigLayout {
  std::vector<SensorSpread> sensors;
  std::uint32_t frames = 0, images = 0;
  std::uint32_t images_of_no_rig = 0;  ///< whose names begin with no prefix
  std::uint32_t copied_cameras = 0;    ///< lenses that sensors shared, which each now has alone
};

/// Lays rigs over a problem that has none, by the names of its images: an image is of the sensor
/// whose prefix its name begins with, and of the frame that the rest of the name tells. Poses of
/// sensors that the configuration does not state are averages over the frames (means of what is
/// within three medians of the geometric median, of rotations and of centres), those of frames are
/// their reference image's, or the same average over their other images. Images get the poses that
/// their frames and sensors give; sensors that share a lens get copies of it. Errors: usage, and
/// the problem is then as it was.
Result<RigLayout> lay_rigs(Problem& problem, const std::vector<RigConfiguration>& rigs);

/// The mean of those motions that are within three medians of the geometric median, of rotations
/// and of translations; `motions` has at least one.
Pose robust_mean(const std::vector<Pose>& motions);

}  // namespace sheaf
