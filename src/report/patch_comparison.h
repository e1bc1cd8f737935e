// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "rows/photometric.h"
#include "sheaf/error.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// One state of a scene, and the patches that are seen at it: by point, then by image.
struct PatchStage {
  PatchState state;
  std::vector<PatchSight> seen;
};

/// A scene before a refinement and after it.
struct PatchComparison {
  PatchScene scene;
  PatchStage before, after;
};

/// A state with its patches, as `examine_photometric` found them with these options.
PatchStage stage_of(const PhotometricProblem& problem, const PhotometricOptions& options,
                    const PhotometricDetails& details);

/// Of two stages of one problem, whose own state does not matter. Errors:
/// ErrorCode::usage.
Result<PatchComparison> compare_patches(const PhotometricProblem& problem,
                                        const PhotometricOptions& options, PatchStage before,
                                        PatchStage after);

/// A point with the root mean square of all its patches' residuals in the images.
struct PatchFit {
  std::uint32_t point = 0;
  double before = 0, after = 0;  ///< grey levels; NaN where no image shows the patch
};

/// The points that some image shows after, the worst after first; equals in their order.
std::vector<PatchFit> rank_patches(const PatchComparison& comparison);

/// What an image shows where it shows a patch.
struct PatchGreys {
  std::vector<double> grey;      ///< with its brightness taken out: compares with the reference
  std::vector<double> residual;  ///< as it counts
};

/// Pixel by pixel in the pattern's order; empty where the stage does not see it.
PatchGreys greys_of(const PatchScene& scene, const PatchStage& stage, const Sight& sight);

}  // namespace sheaf
