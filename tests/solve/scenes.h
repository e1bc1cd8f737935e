// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "geometry/loss.h"
#include "sheaf/problem.h"
#include "sheaf/scene.h"

namespace sheaf {

/// 12 images, 600 points, half a pixel of noise.
Scene small_scene();

/// The same where image i looks through lens i / `together`. The lenses that nobody looks through
/// any more stay in the problem if asked for.
Scene shared_lens_scene(std::uint32_t together, bool keep_unused);

/// 1/2 sum rho(|r|^2), one observation at a time.
double robust_cost(const Problem& problem, const ScaledLoss& loss);

/// Largest |dcost / dx_i| / |J_i| over the free parameters, by central differences of `evaluate`
/// (or `robust_cost`), which shares no code with the solver's Jacobians: poses move by their left
/// perturbation, lenses as a whole. Points beyond the first `points` are left out.
double scaled_gradient(const Problem& problem, const Fixed& fixed = {}, std::size_t points = 40,
                       const ScaledLoss& loss = {});

/// The problem with pixels that its state explains exactly, but for normal noise and for
/// `outliers` of them that are off by `size_px` in some direction.
struct Pixels {
  double noise_px = 0.5, outliers = 0, outlier_px = 50;
  std::uint64_t seed = 1;
};
Problem with_pixels(const Problem& truth, const Pixels& pixels);

/// Moves poses, focal lengths and points: standard deviations in radians, in units of the median
/// depth (centres and points), relative (focals).
struct Disturbance {
  double rotation_rad = 2e-3, center = 2e-3, point = 5e-3, focal = 2e-3;
  std::uint64_t seed = 1;
};
void disturb(Problem& problem, const Disturbance& by);

/// Turns a camera by a rotation vector (radians); its centre stays.
void turn_about_centre(Pose& pose, const std::array<double, 3>& by);

/// A file of tests/data, an input that once failed.
std::string case_file(const std::string& name);

/// A real problem's path, or "" when it is not there: $SHEAF_DATA/bal, data/bal by default.
std::string real_data(const std::string& name);

}  // namespace sheaf
