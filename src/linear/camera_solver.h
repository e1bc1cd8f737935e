// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "linear/chunks.h"
#include "linear/columns.h"
#include "linear/dense_cholesky.h"
#include "platform/parallel.h"

namespace sheaf {

/// The reduced camera system before damping, as the elimination leaves it.
struct ReducedSums {
  const Chunks* chunks;
  const double* tiles;     ///< kTileDoubles per tile
  const double* diagonal;  ///< kDiagonalDoubles per image
};

/// Entry (r, k) of an image's symmetric diagonal block, stored 8 + 1.
double diagonal_entry(const double* block, int r, int k);

/// Right-hand side b and diag(J^T J) of the free columns.
struct CameraVectors {
  Buffer<double> rhs, squares;
  void gather(const ReducedSums& sums, const Columns& columns);
};

/// S + lambda diag(J^T J), dense, factored by Cholesky.
class DenseCameraSolver {
 public:
  DenseCameraSolver(const Columns& columns, const char* simd_name);

  static std::uint64_t bytes(std::int32_t columns) { return DenseCholesky::bytes(columns); }

  /// damping: lambda times the clamped diag(J^T J), one for each column. x <- the step.
  bool solve(const ReducedSums& sums, const CameraVectors& vectors, const double* damping,
             Threads& threads, Buffer<double>& x);

 private:
  void add_diagonal(const ReducedSums& sums, std::size_t image);
  void add_tile(const double* tile, const Tile& place);

  const Columns& columns_;
  DenseCholesky cholesky_;
};

}  // namespace sheaf
