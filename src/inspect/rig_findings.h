// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "inspect/finding_list.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Frames without images or observations, or with few; sensors without images, and sensors seen in
/// too few frames to say where they are; rigs whose reference has no images.
void check_rigs(const Problem& problem, FindingList& list);

/// Of each image the frame that its pose hangs on, or kNone: of no rig, or of a frame that is no
/// more than this image.
std::vector<std::uint32_t> rigid_frames_of(const Problem& problem);

/// How far the pose that Problem::poses states of each image is from the one that its frame and
/// sensor give: angle in radians, distance of centres in scene units. 0 for images of no rig.
struct PoseGaps {
  std::vector<double> rotation_rad, center;
};
PoseGaps pose_gaps(const Problem& problem);

}  // namespace sheaf
