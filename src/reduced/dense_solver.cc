// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "platform/cancel.h"
#include "reduced/camera_solver.h"
#include "reduced/dense_cholesky.h"

namespace sheaf {
namespace {

class DenseSolver : public CameraSolver {
 public:
  DenseSolver(const Columns& columns, const Kernels& kernels, Threads& threads)
      : columns_(columns),
        threads_(threads),
        cholesky_(static_cast<std::size_t>(columns.count), kernels.name) {}

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    cholesky_.clear(threads_);
    for (std::size_t i = 0; i < columns_.num_images(); ++i)
      add_diagonal(system.sums.diagonal + kDiagonalDoubles * i, columns_.image(i));
    const std::vector<Tile>& tiles = system.sums.chunks->tiles;
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (t % 1000 == 0) poll_cancelled();
      add_tile(system.sums.tiles + kTileDoubles * t, tiles[t]);
    }
    for (std::size_t c = 0; c < cholesky_.size(); ++c) cholesky_.at(c, c) += system.damping[c];
    if (!cholesky_.factor(threads_, system.cancelled)) return {};
    std::copy(system.vectors->rhs.begin(), system.vectors->rhs.end(), x.begin());
    cholesky_.solve(x.data());
    return {true, 0};
  }

  std::uint64_t bytes() const override { return DenseCholesky::bytes(cholesky_.size()); }

 private:
  void add_diagonal(const double* block, const std::int32_t* c) {
    for (int r = 0; r < 9; ++r)
      for (int k = 0; k <= r; ++k)
        if (c[r] >= 0 && c[k] >= 0)
          cholesky_.at(std::max(c[r], c[k]), std::min(c[r], c[k])) += diagonal_entry(block, r, k);
  }

  /// S -= P + P^T with P = T_a T_b^T at the rows of one image and the columns of the other. Where
  /// both are the same column (a shared lens, a point seen twice) the entry is on the diagonal and
  /// takes both terms.
  void add_tile(const double* tile, const Tile& place) {
    const std::int32_t* row = columns_.image(place.row);
    const std::int32_t* column = columns_.image(place.column);
    for (int r = 0; r < 9; ++r) {
      if (row[r] < 0) continue;
      for (int k = 0; k < 9; ++k) {
        if (column[k] < 0) continue;
        const double value = tile_entry(tile, r, k);
        const double both = row[r] == column[k] ? 2 * value : value;
        cholesky_.at(std::max(row[r], column[k]), std::min(row[r], column[k])) -= both;
      }
    }
  }

  const Columns& columns_;
  Threads& threads_;
  DenseCholesky cholesky_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_dense_solver(const Columns& columns, const Kernels& kernels,
                                                Threads& threads) {
  return std::make_unique<DenseSolver>(columns, kernels, threads);
}

}  // namespace sheaf
