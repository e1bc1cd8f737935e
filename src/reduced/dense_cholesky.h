// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "platform/buffer.h"
#include "platform/parallel.h"

namespace sheaf {

/// One instruction set's dense kernels. A is column-major with leading dimension `lda`, a multiple
/// of 8; rows and columns are cut at multiples of 8. Each entry's sum runs over k in order, so
/// the result does not depend on the width of the vectors nor on the cutting into tasks.
struct DenseKernels {
  const char* name;
  /// Factors the diagonal block of columns [k, k + width): L below the diagonal, 1 / L_jj in
  /// inverse[j]. Returns false at a pivot that is not positive (or not finite).
  bool (*factor_block)(double* A, std::size_t lda, std::size_t k, std::size_t width,
                       double* inverse);
  /// Rows [first, end) of the panel below that block: A <- A L^-T.
  void (*solve_rows)(double* A, std::size_t lda, std::size_t k, std::size_t width,
                     const double* inverse, std::size_t first, std::size_t end);
  /// A[first..end, c..c_end] -= P[rows] P[columns]^T with P the columns [k, k + width).
  void (*update)(double* A, std::size_t lda, std::size_t k, std::size_t width, std::size_t first,
                 std::size_t end, std::size_t c, std::size_t c_end);
  /// C <- P[rows first..end] P[rows c..c_end]^T over `depth` columns of P; C's first row is
  /// `first`.
  void (*product)(const double* P, std::size_t lda, std::size_t depth, std::size_t first,
                  std::size_t end, std::size_t c, std::size_t c_end, double* C, std::size_t ldc);
  /// x <- L^-T L^-1 x.
  void (*substitute)(const double* A, std::size_t lda, std::size_t n, const double* inverse,
                     double* x);
};
const DenseKernels& dense_kernels(const char* simd_name);

/// Cholesky factorisation of a symmetric positive definite matrix, lower triangle, in place.
class DenseCholesky {
 public:
  /// simd_name: "avx512", "avx2", "sse4" or "scalar".
  DenseCholesky(std::size_t n, const char* simd_name);

  static std::uint64_t bytes(std::size_t n);

  void clear(Threads& threads);
  /// Entry of the lower triangle, row >= column.
  double& at(std::size_t row, std::size_t column) { return A_[column * lda_ + row]; }
  double at(std::size_t row, std::size_t column) const { return A_[column * lda_ + row]; }
  std::size_t size() const { return n_; }

  /// False where a pivot is not positive: the matrix is not positive definite to rounding; or
  /// where it was cancelled, which is asked once for each panel.
  bool factor(Threads& threads, const std::function<bool()>* cancelled = nullptr);
  /// x <- A^-1 x, after factor(). x has room for size() rounded up to a multiple of 8.
  void solve(double* x) const;

 private:
  static constexpr std::size_t kPanel = 32;
  static std::size_t leading(std::size_t n);
  bool factor_diagonal(std::size_t k, std::size_t width);
  void solve_below(std::size_t k, std::size_t width, std::size_t first, std::size_t last);

  const DenseKernels& kernels_;
  std::size_t n_, lda_;
  Buffer<double> A_;
  std::vector<double> inverse_;
};

}  // namespace sheaf
