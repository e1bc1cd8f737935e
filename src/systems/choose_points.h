// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/options.h"
#include "sheaf/problem.h"

namespace sheaf {

/// The coordinates in which points step, and why.
struct PointChoice {
  PointParametrisation points = PointParametrisation::xyz;
  bool crosses = true;  ///< a step may take a point through infinity, to the other side
  std::string reason{};
};

/// What the choice works in, so that it can be made again without allocating anything.
struct ParallaxScratch {
  /// A point that is looked at: its first ray, and whether a ray is far enough from it.
  struct Looked {
    std::uint32_t rays = 0;
    Vector3<double> first{};
    bool large = false;
  };
  std::vector<Looked> looked;
  std::vector<Vector3<double>> centres;  ///< of the images
  std::vector<double> tangents;          ///< of each camera: of the angle that is enough
};

/// What is asked for; for `automatic`, inverse depth that may not cross infinity where at least 2 %
/// of the points are seen under a parallax of less than 20 px, else X, Y, Z. (A pixel of noise
/// moves such a point by more than a twentieth of its depth, which no linear model in X, Y, Z
/// follows. Streets have 12 % of them and more, collections of photographs 0.2 % at most. Under a
/// loss points that may not cross end later than in X, Y, Z, unless half of all have so little
/// parallax.) The rule looks at the problem and its state alone. skip: 1 for each observation to
/// leave out, or empty.
PointChoice choose_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                          const SolveOptions& options);
void choose_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                   const SolveOptions& options, ParallaxScratch& scratch, PointChoice& out);

// The two halves of the choice, for those who have the share of all points from several places.

/// Whether the options leave the choice to the share; else `out` is it.
bool asks_for_parallax(const SolveOptions& options, PointChoice& out);
/// The choice for this share of points with a parallax below kSmallParallax_px.
void choose_by_parallax(double share, const SolveOptions& options, PointChoice& out);
constexpr double kSmallParallax_px = 20;

/// Of the points that at least two images see, the part that is seen under a parallax of less than
/// `parallax_px`: the largest angle between the ray of a point's first observation and another
/// one, times that image's focal length. Of many points some, evenly spread, are looked at.
double share_of_small_parallax(const Problem& problem, const std::vector<std::uint8_t>& skip,
                               double parallax_px, ParallaxScratch& scratch);

}  // namespace sheaf
