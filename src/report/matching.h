// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What an estimate and a reference have in common.
struct Matching {
  /// By what images are told: their names where both models state them, else their ids where both
  /// state those and none states names, else their order.
  enum class By { names, ids, order } by = By::order;
  struct Pair {
    std::size_t estimate = 0, reference = 0;  ///< indices
  };
  std::vector<Pair> images, points;  ///< in the reference's order
  bool has_points = true;            ///< false: which points are the same cannot be told
  bool in_order = true;              ///< all images and points, and each has the same index in both
  std::vector<std::size_t> only_in_estimate, only_in_reference;  ///< images
  std::size_t points_only_in_estimate = 0, points_only_in_reference = 0;

  bool complete() const {
    return only_in_estimate.empty() && only_in_reference.empty() && has_points &&
           points_only_in_estimate == 0 && points_only_in_reference == 0;
  }
};

/// Points are the same by their ids (or order) where both models have the same images, as many
/// points, and the same ids; else those with the same id that the same features of the common
/// images observe. Errors (ErrorCode::usage): other counts where images are told by their order, a
/// name that occurs twice where names differ, fewer than three images in common where some are not.
Result<Matching> match_models(const Problem& estimate, const Problem& reference);

/// How a message calls an image: its name, its id or its number, by what images are told.
std::string called(const Problem& problem, std::size_t image, Matching::By by);

/// The poses, lenses, rigs and points of one of the two models that both have, in the reference's
/// order; without observations, terms and metadata.
Problem common_of_estimate(const Problem& estimate, const Matching& matching);
Problem common_of_reference(const Problem& reference, const Matching& matching);

}  // namespace sheaf
