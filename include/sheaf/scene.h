// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A synthetic scene. The same options give the same bytes on every machine.
struct SceneOptions {
  std::uint64_t images = 16;
  std::uint64_t points = 4000;
  double mean_track = 4;              ///< observations per point, on average (at least 2)
  double pixel_noise_px = 0.5;        ///< standard deviation of the measurements
  double rotation_noise_rad = 0.005;  ///< of the start
  double center_noise = 0.02;  ///< of the start, scene units (the cameras stand about 1 apart)
  double point_noise = 0.05;   ///< of the start, scene units
  double focal_noise = 0.01;   ///< of the start, relative
  std::uint64_t seed = 1;
};

struct Scene {
  Problem start;  ///< disturbed: what a solver is given
  Problem truth;  ///< what made the measurements (before pixel noise)
};

/// Errors: ErrorCode::usage when the counts cannot be met.
Result<Scene> generate(const SceneOptions& options);

}  // namespace sheaf
