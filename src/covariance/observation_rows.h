// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "covariance/parameter_blocks.h"
#include "geometry/lens.h"
#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// The linearised rows of single observations, by plain formulas that share nothing with the
/// kernels: residuals in sigmas of the observation.
class ObservationRows {
 public:
  /// Two rows by the columns of one block.
  struct Part {
    std::uint32_t block = 0, width = 0;
    std::array<double, 2 * ParameterBlocks::kWidest> J{};  ///< row r from J[9 r] on
  };
  struct Row {
    std::array<double, 2> r{};
    std::array<double, 6> point{};  ///< 2 x 3, row-major
    std::array<Part, 4> parts{};
    std::size_t count = 0;  ///< of parts
  };

  /// Both must outlive it.
  ObservationRows(const Problem& problem, const ParameterBlocks& blocks);

  void evaluate(std::size_t observation, Row& out) const;
  /// The image's pose columns into those of its blocks: parts of `width` 6 of J, rows x 6 with the
  /// stride given.
  struct PosePart {
    std::uint32_t block;
    std::array<double, 36> by_image;  ///< d(image's six) / d(block's six), row-major
  };
  const std::vector<PosePart>& pose_parts(std::size_t image) const { return poses_[image]; }

 private:
  void add_pose(std::size_t image, const std::array<double, 12>& J, Row& out) const;
  void add_lens(std::size_t image, const LensJacobian<double>& lens, double scale, Row& out) const;

  const Problem& problem_;
  const ParameterBlocks& blocks_;
  std::vector<Matrix3<double>> rotations_;
  std::vector<std::vector<PosePart>> poses_;
};

}  // namespace sheaf
