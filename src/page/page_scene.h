// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/rotation.h"
#include "inspect/pattern.h"
#include "scene/similarity.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What one state makes of the measurements.
struct StateNumbers {
  std::vector<Matrix3<double>> rotation;  ///< cam_from_world of each image, row-major
  std::vector<Vector3<double>> centre;    ///< of each image's camera, the result's world
  /// Residuals, modelled less measured: px, x to the right and y down; NaN where the state has
  /// none.
  std::vector<float> x, y, length;
  std::vector<double> image_rms, point_rms;  ///< px; NaN where nothing is known
  double rms = 0;                            ///< px: of all that are finite
  double median = 0, q99 = 0;                ///< px: of their lengths
  std::uint64_t counted = 0;                 ///< residuals that are finite
};

/// A rectangle of pixels that an image's measurements lie in, and its middle.
struct ImageFrame {
  std::array<double, 2> middle{}, half{1, 1};  ///< px
};

/// Two states of one scene as a page shows them: what was found, and the start carried over to the
/// same images, points and measurements. Cameras look along +z with y down, whatever the file says.
struct PageScene {
  Problem result;  ///< images of rigs are placed
  Problem start;   ///< likewise; no state where `has_start` is false
  bool has_start = false;
  bool has_bal_lenses = false;                         ///< before they were restated
  std::vector<std::uint8_t> start_image, start_point;  ///< 1: the start has it
  StateNumbers before, after;
  Similarity
      onto_result;  ///< what the start was moved by before it was measured against the result

  std::vector<std::string> names;           ///< of images, as short as tells them apart
  std::vector<ImageFrame> frames;           ///< one for each image
  bool sizes_known = true;                  ///< frames are images, not the reach of measurements
  std::vector<std::uint64_t> begin, order;  ///< observations by image, in their order there
  std::vector<std::uint32_t> track;         ///< observations of each point
  std::vector<Link> links;                  ///< pairs of images with points in common, ascending
  std::vector<std::uint32_t> worst;         ///< images with measurements, by rms after, worst first
  double sigma = 0;  ///< px: of one coordinate, from the median residual after; 0: nothing is left

  std::size_t num_images() const { return names.size(); }
  std::size_t num_points() const { return track.size(); }
  std::uint64_t observations(std::size_t image) const { return begin[image + 1] - begin[image]; }
};

struct PageSceneOptions {
  bool placed = false;  ///< the frame means something: the start is not moved onto the result
  int threads = 0;      ///< 0: all
};

/// start: null where there is but one state. Errors: usage for two problems that are not of one
/// scene, as `match_models` says.
Result<PageScene> page_scene(const Problem* start, const Problem& result,
                             const PageSceneOptions& options = {});

/// The value that this part of the finite ones does not exceed; 0 of none. Reorders them.
double quantile(std::vector<float>& values, double part);

/// Without the folders and the ending that all have in common.
std::vector<std::string> short_names(std::vector<std::string> names);

}  // namespace sheaf
