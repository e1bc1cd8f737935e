// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "reduced/block_diagonal.h"
#include "reduced/block_rows.h"
#include "reduced/camera_solver.h"
#include "reduced/conjugate_gradients.h"
#include "reduced/preconditioner.h"
#include "reduced/scaling.h"

namespace sheaf {
namespace {

/// S as block rows of T, double or float; each off-diagonal block stands in both of its rows, so
/// that a row's sum has one owner. Rows and columns are scaled towards a unit diagonal of J^T J, by
/// powers of two, so that floats neither lose range to the units of a column nor digits to scaling.
template <class T>
class ExplicitOperator : public ImageOperator {
 public:
  ExplicitOperator(const Columns& columns, const Chunks& chunks, const char* simd_name,
                   Threads& threads)
      : columns_(columns),
        chunks_(chunks),
        kernels_(block_row_kernels(simd_name)),
        threads_(threads),
        first_(columns.num_images() + 1, 0) {
    const std::size_t images = columns.num_images();
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
    entries_.allocate(kBlockEntry * image_.size());
    scales_.allocate(kImageVector * images);
    x_.allocate(kImageVector * images);
    scales_.fill(0), x_.fill(0);
  }

  void assemble(const CameraSystem& system) {
    const std::size_t images = columns_.num_images();
    for (std::size_t i = 0; i < images; ++i)
      for (int k = 0; k < 9; ++k)
        if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
          scales_[kImageVector * i + k] = towards_one(std::sqrt(system.vectors->squares[c]));
    in_tasks(images, [&](std::size_t i) {
      const double* block = system.sums.diagonal + kDiagonalDoubles * i;
      fill(first_[i], i, i, [&](int r, int k) { return diagonal_entry(block, r, k); });
    });
    in_tasks(chunks_.tiles.size(), [&](std::size_t t) {
      const double* tile = system.sums.tiles + kTileDoubles * t;
      const Tile& at = chunks_.tiles[t];
      const auto entry = [tile](int r, int k) { return -tile_entry(tile, r, k); };
      fill(of_tile_[2 * t], at.row, at.column, entry);
      fill(of_tile_[2 * t + 1], at.column, at.row, [&](int r, int k) { return entry(k, r); });
    });
  }

  void apply(const double* x, double* y) override {
    const std::size_t images = columns_.num_images();
    double most = 0;
    for (std::size_t i = 0; i < kImageVector * images; ++i)
      if (scales_[i] > 0) most = std::max(most, std::abs(x[i] / scales_[i]));
    const double scale = towards_one(most);
    for (std::size_t i = 0; i < kImageVector * images; ++i)
      if (scales_[i] > 0) x_[i] = static_cast<T>(x[i] / scales_[i] * scale);
    in_tasks(images, [&](std::size_t i) {
      alignas(64) double sums[kImageVector];
      const T* blocks = &entries_[kBlockEntry * first_[i]];
      multiply(blocks, &image_[first_[i]], first_[i + 1] - first_[i], sums);
      for (int k = 0; k < 9; ++k)
        if (const double s = scales_[kImageVector * i + k]; s > 0)
          y[kImageVector * i + k] = sums[k] / s / scale;
    });
  }

  std::uint64_t bytes() const {
    return entries_.bytes() + 12 * image_.size() + 8 * first_.size() + scales_.bytes() + x_.bytes();
  }

 private:
  template <class Entry>
  void fill(std::uint64_t e, std::size_t row, std::size_t column, const Entry& entry) {
    T* to = &entries_[kBlockEntry * e];
    const double *r_scale = &scales_[kImageVector * row],
                 *k_scale = &scales_[kImageVector * column];
    for (int k = 0; k < 9; ++k)
      for (int r = 0; r < 8; ++r)
        to[block_entry::at(r, k)] = static_cast<T>(entry(r, k) * (r_scale[r] * k_scale[k]));
    for (int k = 0; k < 9; ++k)
      to[block_entry::at(8, k)] = static_cast<T>(entry(8, k) * (r_scale[8] * k_scale[k]));
  }

  void multiply(const double* blocks, const std::uint32_t* image, std::size_t count, double* y) {
    kernels_.multiply(blocks, image, count, x_.data(), y);
  }
  void multiply(const float* blocks, const std::uint32_t* image, std::size_t count, double* y) {
    kernels_.multiply_float(blocks, image, count, x_.data(), y);
  }

  template <class Task>
  void in_tasks(std::size_t count, const Task& task) {
    constexpr std::size_t kPerTask = 64;
    threads_.for_each((count + kPerTask - 1) / kPerTask, [&](std::size_t t) {
      const std::size_t end = std::min(count, (t + 1) * kPerTask);
      for (std::size_t i = t * kPerTask; i < end; ++i) task(i);
    });
  }

  const Columns& columns_;
  const Chunks& chunks_;
  const BlockRowKernels& kernels_;
  Threads& threads_;
  std::vector<std::uint64_t> first_;    ///< entries of each row; the first is the diagonal block
  std::vector<std::uint32_t> image_;    ///< whose x an entry multiplies
  std::vector<std::uint64_t> of_tile_;  ///< a tile's two entries
  Buffer<T> entries_;                   ///< kBlockEntry each
  Buffer<double> scales_;               ///< kImageVector per image; 0 where the column is fixed
  Buffer<T> x_;                         ///< kImageVector per image, scaled
};

/// In mixed precision the blocks are floats until the system asks for double; from then on doubles.
class ExplicitSolver : public CameraSolver {
 public:
  ExplicitSolver(const Columns& columns, const Chunks& chunks, bool mixed, const Kernels& kernels,
                 Threads& threads)
      : columns_(columns),
        chunks_(chunks),
        simd_name_(kernels.name),
        threads_(threads),
        blocks_(columns, threads),
        cg_(columns) {
    if (mixed)
      rounded_.emplace(columns, chunks, simd_name_, threads);
    else
      exact_.emplace(columns, chunks, simd_name_, threads);
  }

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    if (system.precise && rounded_) {
      rounded_.reset();
      exact_.emplace(columns_, chunks_, simd_name_, threads_);
    }
    return rounded_ ? run(*rounded_, system, x) : run(*exact_, system, x);
  }
  CameraSolution shorten(const CameraSystem& system, Buffer<double>& x) override {
    return cg_.shorten(system, x);
  }
  RecycledModes::History history() const override { return cg_.history(); }
  bool restore(const RecycledModes::History& history) override { return cg_.restore(history); }
  std::uint64_t bytes() const override {
    return (rounded_ ? rounded_->bytes() : exact_->bytes()) + blocks_.bytes() + cg_.bytes();
  }

 private:
  template <class T>
  CameraSolution run(ExplicitOperator<T>& S, const CameraSystem& system, Buffer<double>& x) {
    S.assemble(system);
    return cg_.run(S, Preconditioner{blocks_, system.coarse}, system, x);
  }

  const Columns& columns_;
  const Chunks& chunks_;
  const char* simd_name_;
  Threads& threads_;
  std::optional<ExplicitOperator<float>> rounded_;
  std::optional<ExplicitOperator<double>> exact_;
  BlockDiagonal blocks_;
  ConjugateGradients cg_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_explicit_solver(const Columns& columns, const Chunks& chunks,
                                                   bool mixed, const Kernels& kernels,
                                                   Threads& threads) {
  return std::make_unique<ExplicitSolver>(columns, chunks, mixed, kernels, threads);
}

}  // namespace sheaf
