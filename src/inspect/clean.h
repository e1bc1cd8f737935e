// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// What to leave out of a problem; nothing by default.
struct CleanOptions {
  double max_error_px = 0;   ///< observations with a longer (or not finite) residual; 0: none
  bool behind = false;       ///< observations whose point is behind the camera, in its plane or at
                             ///< its centre
  bool repeated = false;     ///< observations of a point at a pixel where the image has it already
  double min_angle_deg = 0;  ///< points whose rays meet at less than this at most; 0: none
  std::uint32_t min_track = 0;  ///< points with fewer observations left
  bool any() const {
    return max_error_px > 0 || behind || repeated || min_angle_deg > 0 || min_track > 0;
  }
};

/// What was left out, by its numbers in the problem as it was, ascending.
struct CleanRecord {
  std::vector<std::uint64_t> far_off;       ///< observations, by their error
  std::vector<std::uint64_t> behind;        ///< observations
  std::vector<std::uint64_t> in_plane;      ///< observations: Z = 0 in the camera
  std::vector<std::uint64_t> at_centre;     ///< observations
  std::vector<std::uint64_t> repeated;      ///< observations
  std::vector<std::uint64_t> narrow;        ///< points, by the angle of their rays
  std::vector<std::uint64_t> short_tracks;  ///< points, of what the others left
  std::uint64_t observations = 0;           ///< fewer than before
};

/// Observations first, then points by the rays that are left, then by their number.
CleanRecord clean(Problem& problem, const CleanOptions& options);

/// Observations of a point in an image that has it already, ascending: at the same pixel, and at
/// another one.
struct Repetitions {
  std::vector<std::uint64_t> same_pixel, other_pixel;
};
Repetitions repetitions_in(const Problem& problem);

/// Largest angle at which two rays of each point meet, degrees; 0 for one with fewer than two. Of a
/// track of more than 64 observations, 64 spread over it are looked at. threads: 0 takes all; the
/// bits do not depend on it.
std::vector<double> ray_angles_deg(const Problem& problem, const std::vector<bool>& kept,
                                   int threads = 1);

}  // namespace sheaf
