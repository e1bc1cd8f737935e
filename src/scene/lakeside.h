// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// The place of the synthetic scenes. Photographs are taken about one unit apart on the shore of a
/// round lake, looking across it: at house fronts and ground near the shore, which few images
/// share, and at hills farther in, which many do. With many images the shore is a closed ring; with
/// few it is an arc. The world's z points up; (0, 0) is the lake's centre.
///
/// All numbers come out of correctly rounded operations: the same bits on every machine.
class Lakeside {
 public:
  struct Station {
    std::array<double, 3> angle_axis;  ///< cam_from_world, radians
    std::array<double, 9> rotation;    ///< the same, row-major
    std::array<double, 3> translation;
    std::array<double, 3> intrinsics;  ///< f (px), k1, k2
  };

  Lakeside(std::uint32_t images, std::uint64_t seed);

  const std::vector<Station>& stations() const { return stations_; }
  bool closed() const { return closed_; }

  /// A point that the images [first, first + count) (modulo their number) have in their frame,
  /// barring bad luck with their jitter: `sees` tells. Attempts with a higher number are safer.
  std::array<double, 3> point_before(std::uint32_t first, std::uint32_t count, int attempt,
                                     class Random& random) const;

  /// Whether the image has the point in its frame and at least half a unit in front.
  bool sees(std::uint32_t image, const std::array<double, 3>& point) const;

  /// Pixel by the BAL camera's formula.
  std::array<double, 2> project(std::uint32_t image, const std::array<double, 3>& point) const;

 private:
  double angle_of(double position) const { return position / radius_; }
  std::array<double, 3> in_camera(std::uint32_t image, const std::array<double, 3>& point) const;
  double front_depth(double position) const;

  std::vector<Station> stations_;
  std::uint64_t seed_;
  double radius_;
  bool closed_;
};

}  // namespace sheaf
