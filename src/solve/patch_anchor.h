// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "rows/anchor.h"
#include "rows/photometric.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// The measured positions that count: all but those in a point's host, where its ray is what was
/// measured. None where the options ask for no anchor.
std::vector<Measurement> measurements_of(const PhotometricProblem& problem,
                                         const PhotometricOptions& options);

/// The anchor as a level of the pyramid sees it, distances in units of their standard deviation
/// being the same on all; without the measurements of points that are behind their cameras.
Anchor anchor_of_level(const std::vector<Measurement>& measurements, const PatchScene& scene,
                       const PatchState& state, const PhotometricOptions& options, int level,
                       double sigma_grey);

/// Root mean square of the distances, pixels; `scene` is that of the full image.
double rms_of(const std::vector<Measurement>& measurements, const PatchScene& scene,
              const PatchState& state);

/// What is wrong with the options of an anchor, or nothing.
Result<void> check_anchor(const PhotometricProblem& problem, const PhotometricOptions& options);

}  // namespace sheaf
