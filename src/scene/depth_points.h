// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/photometric.h"

namespace sheaf {

/// Depths along the optical axis, scene units, row by row; 0 where none is known.
struct DepthMap {
  int width = 0, height = 0;
  std::vector<float> depth;

  float at(int x, int y) const {
    return depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)];
  }
};

struct DepthPointRules {
  int cell_px = 16;            ///< at most one point in each square of this size
  double least_slope = 2;      ///< grey levels per pixel
  std::uint32_t most = 20000;  ///< points, those with the steepest slopes
};

/// Points of the images (one depth map each): in every cell the pixel where the grey level is
/// steepest, if that is steep enough and the depth is known and smooth around it. A point's host is
/// its image. Replaces points and hosts.
void choose_points(const std::vector<DepthMap>& maps, const DepthPointRules& rules,
                   PhotometricProblem& problem);

/// Sets the problem's sights: each point in every image but its host where it is in front, inside,
/// and as deep as the image's depth map says.
void find_sights(const std::vector<DepthMap>& maps, double depth_tolerance,
                 PhotometricProblem& problem);

/// The point of a pixel at this depth of an image.
void place_on_ray(PhotometricProblem& problem, std::size_t point, double depth);
/// The depth of a point in an image.
double depth_in(const PhotometricProblem& problem, std::size_t point, std::size_t image);

}  // namespace sheaf
