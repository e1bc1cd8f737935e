// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "rows/photometric.h"
#include "sheaf/photometric.h"
#include "sheaf/solve.h"
#include "solve/checkpoint_file.h"
#include "solve/trust_region.h"
#include "systems/home.h"

namespace sheaf {

/// A round of a photometric refinement: what is the same for all of its steps.
struct PatchRound {
  int level = 0, number = 1;
  std::vector<Sight> sights;     ///< patches that count
  double anchor_sigma_grey = 0;  ///< of a pixel, as measured positions are weighed against it
  PatchState start;
};

/// A photometric run before one of its steps, as Checkpoint is of a solve.
struct PhotometricCheckpoint {
  RunIdentity identity;
  Summary solve;
  LoopHistory loop;
  RunProgress progress;
  HomeHistory home;
  PatchRound round;
  PatchState held;
  std::vector<double> leaving;  ///< what patches that leave cost (PhotometricSystem)
  bool brightness_fitted = false;
  double sigma_grey = 0;  ///< that an automatic scale of the loss followed from
};

/// With the fingerprint of images, state and measurements.
RunIdentity identity_of(const PhotometricProblem& problem, const PhotometricOptions& options,
                        const std::string& simd);

/// Written beside and renamed. Errors: unwritable_output.
Result<void> write_checkpoint(const PhotometricCheckpoint& checkpoint, const std::string& path);

/// levels: of the pyramid. Errors: as of a solve's checkpoint.
Result<PhotometricCheckpoint> read_checkpoint(const std::string& path, const RunIdentity& expected,
                                              const PhotometricProblem& problem, int levels);

}  // namespace sheaf
