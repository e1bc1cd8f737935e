// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/rotation.h"
#include "sheaf/scene.h"

namespace sheaf {

/// The noises of images with the same bits on every machine, for the poses of frames.

/// R and C of a frame as the protocol has it: phi turns, d moves the centre.
void disturb_frame(Pose& frame, const NoiseOptions& options, const Vector3<double>& phi,
                   const Vector3<double>& d);

/// sensor_from_rig of all sensors but references; each draws its numbers.
void disturb_sensors(Rigs& rigs, const NoiseOptions& options);

/// Whether some sensor is no reference.
bool has_free_sensors(const Rigs& rigs);

}  // namespace sheaf
