// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/camera_solver.h"

#include <algorithm>

#include "linear/kernels.h"

namespace sheaf {

double diagonal_entry(const double* block, int r, int k) {
  if (r < 8 && k < 8) return block[8 * r + k];
  return r == 8 && k == 8 ? block[88] : block[64 + std::min(r, k)];
}

void CameraVectors::gather(const ReducedSums& sums, const Columns& columns) {
  const std::size_t padded = (static_cast<std::size_t>(columns.count) + 7) / 8 * 8;
  if (rhs.size() != padded) {
    rhs.allocate(padded);
    squares.allocate(padded);
  }
  rhs.fill(0);
  squares.fill(0);
  for (std::size_t i = 0; i < columns.of_image.size() / 9; ++i) {
    const double* block = sums.diagonal + kDiagonalDoubles * i;
    for (int k = 0; k < 9; ++k) {
      const std::int32_t c = columns.image(i)[k];
      if (c == Columns::kFixed) continue;
      rhs[c] -= k < 8 ? block[72 + k] : block[89];
      squares[c] += diagonal_entry(block, k, k) + (k < 8 ? block[80 + k] : block[90]);
    }
  }
}

DenseCameraSolver::DenseCameraSolver(const Columns& columns, const char* simd_name)
    : columns_(columns), cholesky_(static_cast<std::size_t>(columns.count), simd_name) {}

void DenseCameraSolver::add_diagonal(const ReducedSums& sums, std::size_t image) {
  const double* block = sums.diagonal + kDiagonalDoubles * image;
  const std::int32_t* c = columns_.image(image);
  for (int r = 0; r < 9; ++r)
    for (int k = 0; k <= r; ++k)
      if (c[r] >= 0 && c[k] >= 0)
        cholesky_.at(std::max(c[r], c[k]), std::min(c[r], c[k])) += diagonal_entry(block, r, k);
}

/// S -= P + P^T with P = T_a T_b^T at the rows of one image and the columns of the other. Where
/// both are the same column (a shared lens, a point seen twice) the entry is on the diagonal and
/// takes both terms.
void DenseCameraSolver::add_tile(const double* tile, const Tile& place) {
  const std::int32_t* row = columns_.image(place.row);
  const std::int32_t* column = columns_.image(place.column);
  for (int r = 0; r < 9; ++r) {
    if (row[r] < 0) continue;
    for (int k = 0; k < 9; ++k) {
      if (column[k] < 0) continue;
      const double value = k < 8 ? tile[8 * r + k] : tile[r < 8 ? 72 + r : 80];
      const double both = row[r] == column[k] ? 2 * value : value;
      cholesky_.at(std::max(row[r], column[k]), std::min(row[r], column[k])) -= both;
    }
  }
}

bool DenseCameraSolver::solve(const ReducedSums& sums, const CameraVectors& vectors,
                              const double* damping, Threads& threads, Buffer<double>& x) {
  const std::size_t n = cholesky_.size();
  cholesky_.clear(threads);
  for (std::size_t i = 0; i < columns_.of_image.size() / 9; ++i) add_diagonal(sums, i);
  const std::vector<Tile>& tiles = sums.chunks->tiles;
  for (std::size_t t = 0; t < tiles.size(); ++t) add_tile(sums.tiles + kTileDoubles * t, tiles[t]);
  for (std::size_t c = 0; c < n; ++c) cholesky_.at(c, c) += damping[c];
  if (!cholesky_.factor(threads)) return false;
  std::copy(vectors.rhs.begin(), vectors.rhs.end(), x.begin());
  cholesky_.solve(x.data());
  return true;
}

}  // namespace sheaf
