// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/block_diagonal.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

namespace sheaf {
namespace {

bool factor_small(double* A, int n) {
  for (int j = 0; j < n; ++j) {
    for (int k = 0; k < j; ++k)
      for (int i = j; i < n; ++i) A[9 * i + j] -= A[9 * i + k] * A[9 * j + k];
    if (!(A[10 * j] > 0) || !std::isfinite(A[10 * j])) return false;
    const double inverse = 1 / std::sqrt(A[10 * j]);
    for (int i = j + 1; i < n; ++i) A[9 * i + j] *= inverse;
    A[10 * j] = inverse;
  }
  return true;
}

void solve_small(const double* L, int n, double* x) {
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= L[9 * i + k] * x[k];
    x[i] *= L[10 * i];
  }
  for (int i = n; i-- > 0;) {
    for (int k = i + 1; k < n; ++k) x[i] -= L[9 * k + i] * x[k];
    x[i] *= L[10 * i];
  }
}

}  // namespace

BlockDiagonal::BlockDiagonal(const Columns& columns, Threads& threads) : threads_(threads) {
  std::vector<std::uint32_t> uses(static_cast<std::size_t>(columns.count), 0);
  for (std::int32_t c : columns.of_image)
    if (c >= 0) ++uses[c];
  std::map<std::array<std::int32_t, 3>, std::vector<std::uint32_t>> shared;
  const auto add = [](Block& block, const std::int32_t* c, int first, int end) {
    for (int k = first; k < end; ++k) {
      if (c[k] < 0) continue;
      block.column[block.size] = c[k];
      block.local[block.size++] = static_cast<std::int8_t>(k);
    }
  };
  for (std::uint32_t i = 0; i < columns.num_images(); ++i) {
    const std::int32_t* c = columns.image(i);
    const bool own = std::all_of(c + 6, c + 9, [&](auto k) { return k < 0 || uses[k] == 1; });
    Block block;
    add(block, c, 0, own ? 9 : 6);
    block.first_image = images_.size();
    block.num_images = 1;
    images_.push_back(i);
    if (block.size > 0) blocks_.push_back(block);
    if (!own) shared[{c[6], c[7], c[8]}].push_back(i);
  }
  for (const auto& [lens, users] : shared) {
    Block block;
    add(block, columns.image(users[0]), 6, 9);
    block.first_image = images_.size();
    block.num_images = users.size();
    images_.insert(images_.end(), users.begin(), users.end());
    blocks_.push_back(block);
  }
  factors_.allocate(81 * blocks_.size());
}

template <class Task>
void BlockDiagonal::for_each_block(const Task& task) const {
  constexpr std::size_t kBlocksPerTask = 512;
  threads_.for_each((blocks_.size() + kBlocksPerTask - 1) / kBlocksPerTask, [&](std::size_t t) {
    const std::size_t end = std::min(blocks_.size(), (t + 1) * kBlocksPerTask);
    for (std::size_t b = t * kBlocksPerTask; b < end; ++b) task(b);
  });
}

bool BlockDiagonal::factor(const double* diagonal, const double* damping) {
  std::atomic<bool> factored{true};
  double* factors = factors_.data();
  for_each_block([&](std::size_t b) {
    const Block& block = blocks_[b];
    double* A = factors + 81 * b;
    std::fill_n(A, 81, 0.0);
    for (std::size_t i = block.first_image; i < block.first_image + block.num_images; ++i) {
      const double* from = diagonal + kDiagonalDoubles * images_[i];
      for (int r = 0; r < block.size; ++r)
        for (int k = 0; k <= r; ++k)
          A[9 * r + k] += diagonal_entry(from, block.local[r], block.local[k]);
    }
    for (int r = 0; r < block.size; ++r) A[10 * r] += damping[block.column[r]];
    if (!factor_small(A, block.size)) factored = false;
  });
  return factored;
}

void BlockDiagonal::solve(const double* r, double* z) const {
  for_each_block([&](std::size_t b) {
    const Block& block = blocks_[b];
    double x[9];
    for (int k = 0; k < block.size; ++k) x[k] = r[block.column[k]];
    solve_small(&factors_[81 * b], block.size, x);
    for (int k = 0; k < block.size; ++k) z[block.column[k]] = x[k];
  });
}

std::uint64_t BlockDiagonal::bytes() const {
  return factors_.bytes() + blocks_.size() * sizeof(Block) + 4 * images_.size();
}

namespace {

class BlockSolver : public CameraSolver {
 public:
  BlockSolver(const Columns& columns, Threads& threads) : blocks_(columns, threads) {}
  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    blocks_.solve(system.vectors->rhs.data(), x.data());
    return {true, 0};
  }
  std::uint64_t bytes() const override { return blocks_.bytes(); }

 private:
  BlockDiagonal blocks_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_block_solver(const Columns& columns, Threads& threads) {
  return std::make_unique<BlockSolver>(columns, threads);
}

}  // namespace sheaf
