// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "sheaf/problem.h"

namespace sheaf {

/// Counts behind the figure; a nonzero is an entry that the structure allows to be one.
struct PatternCounts {
  std::uint64_t jacobian_rows = 0, jacobian_columns = 0, jacobian_nonzeros = 0;
  std::uint64_t hessian_nonzeros = 0;  ///< J^T J, square in the Jacobian's columns
  std::uint64_t reduced_columns = 0;   ///< of the reduced camera matrix
  std::uint64_t links = 0;             ///< pairs of images with common points
  double fill = 0;                     ///< links as a part of all pairs of images
  std::uint32_t strongest_link = 0;    ///< points that one pair has in common, at most
};

struct PatternFigure {
  std::string svg;  ///< a file's text; the matrices' pixels are pictures in it
  PatternCounts counts;
};

/// Four panels with axes: the images, joined where they have points in common; the
/// Jacobian; J^T J; the reduced camera matrix by images. A pixel of a matrix stands for a block of
/// it where the matrix is larger: its shade is the part of the block that is not zero (for the
/// reduced matrix the largest number of common points), and whatever is not empty shows. Errors:
/// ErrorCode::usage for a problem without images, points or observations.
Result<PatternFigure> draw_patterns(const Problem& problem, const std::string& title);

}  // namespace sheaf
