// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "rows/photometric.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// Whether points are one number each, on the rays of their hosts.
bool uses_rays(const PhotometricProblem& problem, const PhotometricOptions& options);

/// The problem as level 0 (as it is), 1 (half the size), ... of a pyramid sees it: images,
/// intrinsics, and patches taken from the hosts at that level.
PatchScene scene_of_level(const PhotometricProblem& problem, const PhotometricOptions& options,
                          const Pattern& pattern, int level);

/// (x, y, 1) of every point's pixel in its host.
std::vector<double> rays_of(const PhotometricProblem& problem);
/// Pixel (x, y) of a level is at (2 x + 1/2, 2 y + 1/2) of the next larger one.
inline double halved(double x) { return (x - 0.5) / 2; }

PatchState state_of(const PhotometricProblem& problem, bool rays);
void store_state(const PatchState& state, bool rays, PhotometricProblem& problem);

/// The problem's sights, or every point in every image; with rays not in its host, which shows the
/// patch as it is.
std::vector<Sight> all_sights(const PhotometricProblem& problem, bool rays);

/// Zero-normalised cross-correlation of a sight's patch and its image, in [-1, 1]; 0 where either
/// has no texture; -1 where the patch is outside.
double correlation(const PatchScene& scene, const PatchState& state, const Sight& sight);

}  // namespace sheaf
