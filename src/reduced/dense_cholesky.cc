// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/dense_cholesky.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "platform/cancel.h"
#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reduced/dense_cholesky.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Accumulators: kTall vectors of rows x kWide columns fill the registers.
constexpr int kTall = 3;
constexpr int kWide = kLanes == 8 ? 8 : 4;

/// C (Tall vectors x Wide columns) -= rows of P times the columns' rows of P.
template <int Tall, int Wide>
HWY_INLINE void update_tile(double* C, std::size_t lda, const double* rows, const double* columns,
                            std::size_t depth) {
  V acc[Wide][Tall];
  for (int j = 0; j < Wide; ++j)
    for (int i = 0; i < Tall; ++i) acc[j][i] = load(C + j * lda + i * kLanes);
  for (std::size_t l = 0; l < depth; ++l) {
    V a[Tall];
    for (int i = 0; i < Tall; ++i) a[i] = load(rows + l * lda + i * kLanes);
    for (int j = 0; j < Wide; ++j) {
      const V b = set(columns[l * lda + j]);
      for (int i = 0; i < Tall; ++i) acc[j][i] = fnma(a[i], b, acc[j][i]);
    }
  }
  for (int j = 0; j < Wide; ++j)
    for (int i = 0; i < Tall; ++i) store(acc[j][i], C + j * lda + i * kLanes);
}

template <int Wide>
HWY_INLINE void update_columns(double* A, std::size_t lda, std::size_t k, std::size_t depth,
                               std::size_t first, std::size_t end, std::size_t c) {
  const double* P = A + k * lda;
  std::size_t r = std::max(first, c / 8 * 8);
  for (; r + kTall * kLanes <= end; r += kTall * kLanes)
    update_tile<kTall, Wide>(A + c * lda + r, lda, P + r, P + c, depth);
  for (; r < end; r += kLanes) update_tile<1, Wide>(A + c * lda + r, lda, P + r, P + c, depth);
}

void update(double* A, std::size_t lda, std::size_t k, std::size_t depth, std::size_t first,
            std::size_t end, std::size_t c, std::size_t c_end) {
  for (; c + kWide <= c_end; c += kWide) update_columns<kWide>(A, lda, k, depth, first, end, c);
  for (; c < c_end; ++c) update_columns<1>(A, lda, k, depth, first, end, c);
}

template <int Tall, int Wide>
HWY_INLINE void product_tile(double* C, std::size_t ldc, const double* rows, const double* columns,
                             std::size_t lda, std::size_t depth) {
  V acc[Wide][Tall];
  for (int j = 0; j < Wide; ++j)
    for (int i = 0; i < Tall; ++i) acc[j][i] = zero();
  for (std::size_t l = 0; l < depth; ++l) {
    V a[Tall];
    for (int i = 0; i < Tall; ++i) a[i] = load(rows + l * lda + i * kLanes);
    for (int j = 0; j < Wide; ++j) {
      const V b = set(columns[l * lda + j]);
      for (int i = 0; i < Tall; ++i) acc[j][i] = fma(a[i], b, acc[j][i]);
    }
  }
  for (int j = 0; j < Wide; ++j)
    for (int i = 0; i < Tall; ++i) store(acc[j][i], C + j * ldc + i * kLanes);
}

template <int Wide>
HWY_INLINE void product_columns(const double* P, std::size_t lda, std::size_t depth,
                                std::size_t first, std::size_t end, std::size_t c, double* C,
                                std::size_t ldc) {
  std::size_t r = first;
  for (; r + kTall * kLanes <= end; r += kTall * kLanes)
    product_tile<kTall, Wide>(C + r - first, ldc, P + r, P + c, lda, depth);
  for (; r < end; r += kLanes) product_tile<1, Wide>(C + r - first, ldc, P + r, P + c, lda, depth);
}

void product(const double* P, std::size_t lda, std::size_t depth, std::size_t first,
             std::size_t end, std::size_t c, std::size_t c_end, double* C, std::size_t ldc) {
  for (; c + kWide <= c_end; c += kWide, C += kWide * ldc)
    product_columns<kWide>(P, lda, depth, first, end, c, C, ldc);
  // One column by itself waits for its own sums: the rest goes in halves.
  if (kWide > 4 && c + 4 <= c_end) {
    product_columns<4>(P, lda, depth, first, end, c, C, ldc);
    c += 4, C += 4 * ldc;
  }
  if (c + 2 <= c_end) {
    product_columns<2>(P, lda, depth, first, end, c, C, ldc);
    c += 2, C += 2 * ldc;
  }
  if (c < c_end) product_columns<1>(P, lda, depth, first, end, c, C, ldc);
}

/// Columns [k, k + width), width <= 8, of rows [first, end): A <- A L^-T.
HWY_INLINE void solve_narrow(double* A, std::size_t lda, std::size_t k, std::size_t width,
                             const double* inverse, std::size_t first, std::size_t end) {
  for (std::size_t r = first; r < end; r += kLanes) {
    V x[8];
    for (std::size_t j = 0; j < width; ++j) {
      V v = load(A + (k + j) * lda + r);
      for (std::size_t l = 0; l < j; ++l) v = fnma(x[l], set(A[(k + l) * lda + k + j]), v);
      x[j] = hn::Mul(v, set(inverse[k + j]));
      store(x[j], A + (k + j) * lda + r);
    }
  }
}

void solve_rows(double* A, std::size_t lda, std::size_t k, std::size_t width, const double* inverse,
                std::size_t first, std::size_t end) {
  for (std::size_t s = k; s < k + width; s += 8) {
    const std::size_t narrow = std::min<std::size_t>(8, k + width - s);
    solve_narrow(A, lda, s, narrow, inverse, first, end);
    update(A, lda, s, narrow, first, end, s + narrow, k + width);
  }
}

/// Unblocked, of a block at most 8 wide.
bool factor_narrow(double* A, std::size_t lda, std::size_t k, std::size_t width, double* inverse) {
  for (std::size_t j = k; j < k + width; ++j) {
    const double pivot = A[j * lda + j];
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    const double root = std::sqrt(pivot);
    inverse[j] = 1 / root;
    A[j * lda + j] = root;
    for (std::size_t i = j + 1; i < k + width; ++i) A[j * lda + i] *= inverse[j];
    for (std::size_t c = j + 1; c < k + width; ++c)
      for (std::size_t i = c; i < k + width; ++i) A[c * lda + i] -= A[j * lda + i] * A[j * lda + c];
  }
  return true;
}

bool factor_block(double* A, std::size_t lda, std::size_t k, std::size_t width, double* inverse) {
  const std::size_t end = (k + width + 7) / 8 * 8;
  for (std::size_t s = k; s < k + width; s += 8) {
    const std::size_t narrow = std::min<std::size_t>(8, k + width - s);
    if (!factor_narrow(A, lda, s, narrow, inverse)) return false;
    if (s + narrow == k + width) break;
    solve_narrow(A, lda, s, narrow, inverse, s + narrow, end);
    update(A, lda, s, narrow, s + narrow, end, s + narrow, k + width);
  }
  return true;
}

/// sum A[i] x[i] over [first, n) in eight lanes and a fixed tree.
HWY_INLINE double dot_column(const double* column, const double* x, std::size_t first,
                             std::size_t n) {
  double head = 0;
  for (; first < n && first % 8 != 0; ++first) head += column[first] * x[first];
  V sums[kParts];
  for (V& s : sums) s = zero();
  const std::size_t whole = n / 8 * 8;
  for (std::size_t i = first; i < whole; i += 8)
    for (int p = 0; p < kParts; ++p)
      sums[p] = fma(load(column + i + p * kLanes), load(x + i + p * kLanes), sums[p]);
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(sums[p], lanes + p * kLanes);
  for (std::size_t i = std::max(first, whole); i < n; ++i) head += column[i] * x[i];
  return head + sum8(lanes);
}

void substitute(const double* A, std::size_t lda, std::size_t n, const double* inverse, double* x) {
  for (std::size_t j = 0; j < n; ++j) {
    x[j] *= inverse[j];
    const double* column = A + j * lda;
    std::size_t i = j + 1;
    for (; i < n && i % 8 != 0; ++i) x[i] -= column[i] * x[j];
    const V xj = set(x[j]);
    for (; i < n; i += kLanes) store(fnma(load(column + i), xj, load(x + i)), x + i);
  }
  for (std::size_t j = n; j-- > 0;)
    x[j] = (x[j] - dot_column(A + j * lda, x, j + 1, n)) * inverse[j];
}

constexpr DenseKernels table() {
  return {set_name(HWY_TARGET), &factor_block, &solve_rows, &update, &product, &substitute};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const DenseKernels& dense_kernels(const char* simd_name) {
  static constexpr DenseKernels tables[] = SHEAF_TABLES(table);
  return table_named(tables, simd_name);
}

std::size_t DenseCholesky::leading(std::size_t n) {
  const std::size_t lda = (n + 7) / 8 * 8;
  return lda % 512 == 0 ? lda + 8 : lda;  // columns 4 KiB apart would share cache sets
}

std::uint64_t DenseCholesky::bytes(std::size_t n) { return 8 * std::uint64_t(leading(n)) * n; }

DenseCholesky::DenseCholesky(std::size_t n, const char* simd_name)
    : kernels_(dense_kernels(simd_name)), n_(n), lda_(leading(n)), A_(lda_ * n), inverse_(n) {}

void DenseCholesky::clear(Threads& threads) {
  const std::size_t columns = std::max<std::size_t>(1, 65536 / (lda_ + 1));
  threads.for_each((n_ + columns - 1) / columns, [&](std::size_t b) {
    poll_cancelled();
    const std::size_t first = b * columns, end = std::min(n_, first + columns);
    std::memset(&A_[first * lda_], 0, (end - first) * lda_ * sizeof(double));
  });
}

/// Columns [k, k + width) from the diagonal block on down to where that ends.
bool DenseCholesky::factor_diagonal(std::size_t k, std::size_t width) {
  const std::size_t end = k + width, rows = (end + 7) / 8 * 8;
  for (std::size_t s = k; s < end; s += kPanel) {
    const std::size_t w = std::min(kPanel, end - s), next = s + w;
    if (!kernels_.factor_block(A_.data(), lda_, s, w, inverse_.data())) return false;
    if (next == end) break;
    kernels_.solve_rows(A_.data(), lda_, s, w, inverse_.data(), next, rows);
    kernels_.update(A_.data(), lda_, s, w, next, rows, next, end);
  }
  return true;
}

/// Rows [first, last) below that block.
void DenseCholesky::solve_below(std::size_t k, std::size_t width, std::size_t first,
                                std::size_t last) {
  for (std::size_t s = k; s < k + width; s += kPanel) {
    const std::size_t w = std::min(kPanel, k + width - s);
    kernels_.solve_rows(A_.data(), lda_, s, w, inverse_.data(), first, last);
    if (s + w < k + width) kernels_.update(A_.data(), lda_, s, w, first, last, s + w, k + width);
  }
}

bool DenseCholesky::factor(Threads& threads, const std::function<bool()>* cancelled) {
  constexpr std::size_t kRows = 192, kColumns = 64, kSerial = 400;
  // What lies beyond the caches is read and written once for each step: the more columns a step
  // takes, the less often. Small matrices lose by that, to the part that one thread does alone.
  const std::size_t step = n_ < 1000 ? kPanel : n_ < 1500 ? 128 : 256;
  // Below kSerial columns waking threads costs more than the work they would share.
  const auto each = [&](std::size_t tasks, const auto& task) {
    if (n_ >= kSerial) return threads.for_each(tasks, task);
    for (std::size_t t = 0; t < tasks; ++t) task(t);
  };
  const std::size_t rows = (n_ + 7) / 8 * 8;
  for (std::size_t k = 0; k < n_; k += step) {
    if (cancelled != nullptr && (*cancelled)()) return false;
    const std::size_t width = std::min(step, n_ - k), below = k + width;
    if (!factor_diagonal(k, width)) return false;
    if (below >= n_) break;
    each((rows - below + kRows - 1) / kRows, [&](std::size_t b) {
      poll_cancelled();
      const std::size_t first = below + b * kRows;
      solve_below(k, width, first, std::min(rows, first + kRows));
    });
    // Column blocks of the trailing matrix, each in row blocks from its diagonal down.
    const std::size_t blocks = (n_ - below + kColumns - 1) / kColumns;
    const std::size_t down = (rows - below + kRows - 1) / kRows;
    each(blocks * down, [&](std::size_t t) {
      poll_cancelled();
      const std::size_t c = below + t / down * kColumns, c_end = std::min(n_, c + kColumns);
      const std::size_t first = below + t % down * kRows, end = std::min(rows, first + kRows);
      if (end > c) kernels_.update(A_.data(), lda_, k, width, first, end, c, c_end);
    });
  }
  return true;
}

void DenseCholesky::solve(double* x) const {
  kernels_.substitute(A_.data(), lda_, n_, inverse_.data(), x);
}

}  // namespace sheaf
#endif  // HWY_ONCE
