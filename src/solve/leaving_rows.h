// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "sheaf/solver.h"
#include "systems/camera_state.h"
#include "systems/term.h"

namespace sheaf {

/// What leaves a problem: 1 for each image, camera, point.
struct LeavingBlocks {
  std::vector<std::uint8_t> image, camera, point;

  /// Whether an observation leaves, with its point or its image.
  bool takes(const Problem& problem, std::size_t observation) const {
    return image[problem.observation_image[observation]] != 0 ||
           point[problem.observation_point[observation]] != 0;
  }
};

/// Cameras leave with the last of their images. Errors: usage, an index that there is not.
Result<LeavingBlocks> leaving_of(const Problem& problem, const std::vector<std::uint32_t>& images,
                                 const std::vector<std::uint32_t>& points);

/// The rows that leave a problem, and the blocks that they are of: images, then cameras, then
/// points, whose numbers are those that places of the terms name.
struct LeavingRows {
  struct Block {
    GaussianPrior::Block of;  ///< with the state that rows are linearised at
    bool leaves = false;
    bool touched = false;        ///< by some row
    std::vector<bool> held;      ///< for each column
    std::vector<double> step{};  ///< from that state to the problem's, in these columns
  };
  std::vector<Block> blocks;
  std::vector<std::unique_ptr<Term>> terms;  ///< each of a block that leaves
  CameraState first_estimates, now;

  /// Rows of a term, sqrt(w) (J d + b) with d the blocks' differences from their states: J by the
  /// term's places, row-major.
  struct Linear {
    std::vector<double> J, b;
  };
  void linearize(const Term& term, const ScaledLoss& of_observations, Linear& out) const;
};

/// All of them. The problem is valid and has no images of rigs.
LeavingRows leaving_rows(const Problem& problem, const LeavingBlocks& leaving, const Fixed& fixed);

}  // namespace sheaf
