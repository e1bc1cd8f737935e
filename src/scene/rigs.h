// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "geometry/rigid_motion.h"
#include "sheaf/problem.h"

namespace sheaf {

/// sensor_from_rig o rig_from_world; bit for bit the frame where the sensor is the identity.
Pose pose_in_rig(const Pose& sensor_from_rig, const Pose& rig_from_world);

/// The frame's pose that gives an image of this sensor this pose: sensor_from_rig^-1 o
/// cam_from_world; bit for bit the image's where the sensor is the identity.
Pose frame_from_image(const Pose& sensor_from_rig, const Pose& cam_from_world);

/// Whether an image has a frame.
inline bool in_rig(const Rigs& rigs, std::size_t image) {
  return !rigs.empty() && rigs.image_frame[image] != Rigs::kNone;
}

/// Frames that are no more than a pose of one image, taken by its rig's reference sensor: 1 for
/// each frame. Nothing about them differs from an image of no rig.
std::vector<std::uint8_t> trivial_frames(const Rigs& rigs);

/// Whether some image moves with another one or with a sensor.
bool has_rigid_frames(const Rigs& rigs);

/// Sets the poses of trivial frames from those of their images.
void follow_images(Problem& problem);

/// What is wrong with the rigs of a problem, or nothing.
std::optional<std::string> wrong_rigs(const Problem& problem);

}  // namespace sheaf
