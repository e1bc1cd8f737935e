// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include "linear/block_diagonal.h"
#include "linear/camera_solver.h"
#include "linear/conjugate_gradients.h"
#include "linear/preconditioner.h"

namespace sheaf {
namespace {

/// S as block rows. An entry is 88 doubles: nine columns of rows 0..7, then row 8 (nine), 7 unused;
/// each off-diagonal block stands in both of its rows, so that a row's sum has one owner.
class ExplicitOperator : public ImageOperator {
 public:
  ExplicitOperator(std::size_t images, const Chunks& chunks, Threads& threads)
      : chunks_(chunks), threads_(threads), first_(images + 1, 0) {
    for (const Tile& tile : chunks.tiles) {
      ++first_[tile.row + 1];
      ++first_[tile.column + 1];
    }
    for (std::size_t i = 0; i < images; ++i) first_[i + 1] += first_[i] + 1;
    image_.resize(first_.back());
    of_tile_.resize(2 * chunks.tiles.size());
    std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
    for (std::uint32_t i = 0; i < images; ++i) image_[next[i]++] = i;
    for (std::size_t t = 0; t < chunks.tiles.size(); ++t) {
      const Tile& tile = chunks.tiles[t];
      image_[of_tile_[2 * t] = next[tile.row]++] = tile.column;
      image_[of_tile_[2 * t + 1] = next[tile.column]++] = tile.row;
    }
    entries_.allocate(kEntry * image_.size());
  }

  void assemble(const ReducedSums& sums) {
    const std::size_t images = first_.size() - 1;
    in_tasks(images, [&](std::size_t i) {
      const double* block = sums.diagonal + kDiagonalDoubles * i;
      fill(first_[i], [&](int r, int k) { return diagonal_entry(block, r, k); });
    });
    in_tasks(chunks_.tiles.size(), [&](std::size_t t) {
      const double* tile = sums.tiles + kTileDoubles * t;
      fill(of_tile_[2 * t], [&](int r, int k) { return -tile_entry(tile, r, k); });
      fill(of_tile_[2 * t + 1], [&](int r, int k) { return -tile_entry(tile, k, r); });
    });
  }

  void apply(const double* x, double* y) override {
    in_tasks(first_.size() - 1, [&](std::size_t i) {
      double sum[8] = {}, last = 0;
      for (std::uint64_t e = first_[i]; e < first_[i + 1]; ++e) {
        const double* entry = &entries_[kEntry * e];
        const double* v = x + kImageVector * image_[e];
        for (int k = 0; k < 9; ++k)
          for (int r = 0; r < 8; ++r) sum[r] += entry[8 * k + r] * v[k];
        for (int k = 0; k < 9; ++k) last += entry[72 + k] * v[k];
      }
      std::copy(sum, sum + 8, y + kImageVector * i);
      y[kImageVector * i + 8] = last;
    });
  }

  std::uint64_t bytes() const { return entries_.bytes() + 12 * image_.size() + 8 * first_.size(); }

 private:
  static constexpr std::size_t kEntry = 88;

  template <class Entry>
  void fill(std::uint64_t e, const Entry& entry) {
    double* to = &entries_[kEntry * e];
    for (int k = 0; k < 9; ++k)
      for (int r = 0; r < 8; ++r) to[8 * k + r] = entry(r, k);
    for (int k = 0; k < 9; ++k) to[72 + k] = entry(8, k);
  }

  template <class Task>
  void in_tasks(std::size_t count, const Task& task) {
    constexpr std::size_t kPerTask = 64;
    threads_.for_each((count + kPerTask - 1) / kPerTask, [&](std::size_t t) {
      const std::size_t end = std::min(count, (t + 1) * kPerTask);
      for (std::size_t i = t * kPerTask; i < end; ++i) task(i);
    });
  }

  const Chunks& chunks_;
  Threads& threads_;
  std::vector<std::uint64_t> first_;    ///< entries of each row; the first is the diagonal block
  std::vector<std::uint32_t> image_;    ///< whose x an entry multiplies
  std::vector<std::uint64_t> of_tile_;  ///< a tile's two entries
  Buffer<double> entries_;
};

class ExplicitSolver : public CameraSolver {
 public:
  ExplicitSolver(const Columns& columns, const Chunks& chunks, Threads& threads)
      : operator_(columns.num_images(), chunks, threads), blocks_(columns, threads), cg_(columns) {}

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    operator_.assemble(system.sums);
    return cg_.run(operator_, Preconditioner{blocks_, system.coarse}, system, x);
  }
  std::uint64_t bytes() const override { return operator_.bytes() + blocks_.bytes() + cg_.bytes(); }

 private:
  ExplicitOperator operator_;
  BlockDiagonal blocks_;
  ConjugateGradients cg_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_explicit_solver(const Columns& columns, const Chunks& chunks,
                                                   Threads& threads) {
  return std::make_unique<ExplicitSolver>(columns, chunks, threads);
}

}  // namespace sheaf
