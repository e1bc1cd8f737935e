// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/block_solver.h"

#include <array>
#include <atomic>
#include <cmath>

#include "linear/kernels.h"

namespace sheaf {
namespace {

/// Solves the leading n x n of A (lower, row-major, stride 9) for x in place.
bool solve_small(std::array<double, 81>& A, int n, double* x) {
  for (int j = 0; j < n; ++j) {
    for (int k = 0; k < j; ++k)
      for (int i = j; i < n; ++i) A[9 * i + j] -= A[9 * i + k] * A[9 * j + k];
    if (!(A[10 * j] > 0) || !std::isfinite(A[10 * j])) return false;
    const double root = std::sqrt(A[10 * j]);
    for (int i = j; i < n; ++i) A[9 * i + j] /= root;
  }
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= A[9 * i + k] * x[k];
    x[i] /= A[10 * i];
  }
  for (int i = n; i-- > 0;) {
    for (int k = i + 1; k < n; ++k) x[i] -= A[9 * k + i] * x[k];
    x[i] /= A[10 * i];
  }
  return true;
}

}  // namespace

bool solve_blocks(const ReducedSums& sums, const Columns& columns, const CameraVectors& vectors,
                  const double* damping, Threads& threads, Buffer<double>& x) {
  constexpr std::size_t kImagesPerTask = 256;
  const std::size_t images = columns.of_image.size() / 9;
  std::atomic<bool> solved{true};
  threads.for_each((images + kImagesPerTask - 1) / kImagesPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(images, (task + 1) * kImagesPerTask);
    for (std::size_t i = task * kImagesPerTask; i < end; ++i) {
      const double* block = sums.diagonal + kDiagonalDoubles * i;
      const std::int32_t* c = columns.image(i);
      std::array<double, 81> A;
      std::array<double, 9> step;
      std::array<int, 9> kept;
      int n = 0;
      for (int k = 0; k < 9; ++k)
        if (c[k] >= 0) kept[n++] = k;
      for (int r = 0; r < n; ++r) {
        for (int k = 0; k <= r; ++k) A[9 * r + k] = diagonal_entry(block, kept[r], kept[k]);
        A[10 * r] += damping[c[kept[r]]];
        step[r] = vectors.rhs[c[kept[r]]];
      }
      if (!solve_small(A, n, step.data())) solved = false;
      for (int r = 0; r < n; ++r) x[c[kept[r]]] = step[r];
    }
  });
  return solved;
}

}  // namespace sheaf
