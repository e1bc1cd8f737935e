// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// The median of an even number of values is the mean of the middle two. All 0 for no values.
struct Range {
  double min = 0, median = 0, max = 0;
};
Range range_of(std::vector<double> values);

/// What is in a problem. Tracks are the observations of one point.
struct Statistics {
  /// (length, points with that length), ascending, without empty entries.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> track_histogram;
  Range track;
  double mean_track = 0;
  Range observations_per_image;
  double mean_observations_per_image = 0;
  Range focal_px;
  double mean_error_px = 0;  ///< mean of the points' mean |r|, as COLMAP states it for a model
};
Statistics statistics_of(const Problem& problem);

/// What was taken through one lens.
struct CameraStatistics {
  std::uint64_t images = 0, observations = 0;
  double mean_error_px = 0;  ///< mean |r| of the observations whose residual is finite
};
/// One for each lens.
std::vector<CameraStatistics> camera_statistics(const Problem& problem);

/// What of a problem is mounted together.
struct RigCounts {
  std::uint64_t rigs = 0, frames = 0, sensors = 0;
  std::uint64_t images = 0;        ///< that are of a frame
  std::uint64_t rigid_frames = 0;  ///< that are more than the pose of one image
};
RigCounts rig_counts(const Problem& problem);

/// Bytes that the problem's arrays hold.
std::uint64_t size_bytes(const Problem& problem);

}  // namespace sheaf
