// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "report/alignment.h"
#include "report/matching.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// How a model is brought onto another one.
struct ModelAlignmentOptions {
  bool robust = true;                   ///< those far off do not count; else least squares
  AlignScale scale = AlignScale::free;  ///< `one`: a rigid motion
};

/// What brings a model onto a reference by the centres of common images.
struct ModelAlignment {
  Matching matching;              ///< the model is its `estimate`
  Similarity similarity;          ///< from the model's world to the reference's
  std::size_t inliers = 0;        ///< common images that a robust alignment counts on; else all
  std::vector<double> distances;  ///< of the centres afterwards, one for each common image, in
                                  ///< scene units of the reference
};

/// Nothing is moved yet: `move` does that. Errors (ErrorCode::usage): those of `match_models`;
/// fewer than three common images; centres that are in a line to about one per cent of its length,
/// or in one place, which leave the rotation open.
Result<ModelAlignment> align_models(const Problem& model, const Problem& reference,
                                    const ModelAlignmentOptions& options = {});

/// The numbers of the common images, from the one that ends farthest off.
std::vector<std::size_t> worst_first(const ModelAlignment& alignment);

}  // namespace sheaf
