// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/scene.h"

namespace sheaf {

class Random;

/// Errors of a scene's start, the same bits on every machine.

/// R <- exp(phi) R and C <- C + d, phi and d of independent normal components.
void disturb_pose(Random& random, double rotation_rad, double center, Pose& pose);

/// Focal lengths by their noise; what bends rays by ten times as much of its size. Principal points
/// stay: by default they are not refined.
void disturb_lenses(const SceneOptions& options, Problem& start);

}  // namespace sheaf
