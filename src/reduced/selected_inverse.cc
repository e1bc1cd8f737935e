// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The entries of Z = A^-1 on the pattern of the factor A = L L^T, by recursion from the last
// supernode to the first (Takahashi, Fagan and Chin 1973; by supernodes as in Lin et al., SelInv,
// 2011). With J the columns of a supernode, R the rows below it and Y = L_RJ L_JJ^-1,
//   Z_RJ = -Z_RR Y,     Z_JJ = (L_JJ L_JJ^T)^-1 - Y^T Z_RJ,
// and Z_RR is known by then: the rows of R are columns of ancestors, whose panels have them.
#include <algorithm>
#include <cstring>

#include "platform/cancel.h"
#include "reduced/sparse_cholesky.h"

namespace sheaf {
namespace {

constexpr std::size_t kDepth = 256, kRows = 96, kColumns = 32;

std::size_t padded(std::size_t n) { return (n + 7) / 8 * 8; }

/// Column-major work space of one supernode: rows Z_RJ^T (w), then Y^T (w), then R (u). Columns of
/// the same numbers: targets Z_JJ and Z_RJ, then the depths of both products. The dense kernels
/// leave out what is above the diagonal, where no target stands.
struct Work {
  Buffer<double> A;
  std::size_t u = 0, w = 0, up = 0, wp = 0, lda = 0;
  std::size_t y = 0, r = 0;  ///< first row of Y^T and of R

  void shape(std::size_t below, std::size_t width) {
    u = below, w = width, up = padded(u), wp = padded(w);
    y = wp, r = 2 * wp;
    lda = r + up;
    const std::size_t needed = lda * lda;
    if (A.size() < needed) A.allocate(needed);
  }
  double* column(std::size_t c) { return A.data() + c * lda; }
};

/// L_RJ in the first rows, then L_JJ^-T: the factors of Y.
struct Sides {
  Buffer<double> B;
  std::size_t lda = 0;

  void fill(const Supernode& s, const double* panel, const std::vector<double>& inverse,
            std::size_t up, std::size_t wp) {
    const auto u = static_cast<std::size_t>(s.below), w = static_cast<std::size_t>(s.width);
    lda = up + wp;
    if (B.size() < lda * w) B.allocate(lda * w);
    for (std::size_t k = 0; k < w; ++k) {
      double* column = B.data() + k * lda;
      std::memcpy(column, panel + k * s.lda + s.top, u * sizeof(double));
      std::fill_n(column + u, lda - u, 0.0);
      for (std::size_t j = 0; j <= k; ++j) column[up + j] = inverse[j * w + k];
    }
  }
};

/// Y^T into rows up.. of the depths.
void multiply_by_inverse(const DenseKernels& kernels, const Sides& sides, Work& work,
                         Threads& threads) {
  const std::size_t tasks = (work.up + kRows - 1) / kRows;
  const auto run = [&](std::size_t t) {
    poll_cancelled();
    alignas(64) double C[kRows * kColumns];
    const std::size_t low = t * kRows, high = std::min(work.up, low + kRows);
    for (std::size_t j = 0; j < work.w; j += kColumns) {
      const std::size_t end = std::min(work.w, j + kColumns);
      kernels.product(sides.B.data(), sides.lda, work.w, low, high, work.up + j, work.up + end, C,
                      kRows);
      for (std::size_t r = low; r < std::min(high, work.u); ++r)
        for (std::size_t c = j; c < end; ++c)
          work.column(work.r + r)[work.y + c] = C[(c - j) * kRows + r - low];
    }
  };
  if (threads.count() > 1 && tasks > 1)
    threads.for_each(tasks, run);
  else
    for (std::size_t t = 0; t < tasks; ++t) run(t);
}

/// A[rows, targets] -= sum over the depths of A[rows, k] A[targets, k].
void subtract_product(const DenseKernels& kernels, Work& work, std::size_t first, std::size_t end,
                      std::size_t target, std::size_t target_end, Threads& threads) {
  const std::size_t tasks = (end - first + kRows - 1) / kRows;
  const auto run = [&](std::size_t t) {
    poll_cancelled();
    const std::size_t low = first + t * kRows, high = std::min(end, low + kRows);
    for (std::size_t k = 0; k < work.u; k += kDepth)
      for (std::size_t c = target; c < target_end; c += kColumns)
        kernels.update(work.A.data(), work.lda, work.r + k, std::min(kDepth, work.u - k), low, high,
                       c, std::min(target_end, c + kColumns));
  };
  if (threads.count() > 1 && tasks > 1 && work.u * work.w > 4096)
    threads.for_each(tasks, run);
  else
    for (std::size_t t = 0; t < tasks; ++t) run(t);
}

}  // namespace

std::uint64_t SparseCholesky::invert_bytes(const SymbolicFactor& symbolic) {
  std::uint64_t most = 0;
  for (const Supernode& s : symbolic.supernodes) {
    const std::uint64_t lda =
        padded(static_cast<std::size_t>(s.below)) + 2 * padded(static_cast<std::size_t>(s.width));
    most = std::max(most, 8 * lda * lda);
  }
  return most;
}

void SparseCholesky::invert(Threads& threads) {
  Work work;
  Sides sides;
  std::vector<double> inverse;         // of L_JJ, transposed: [k w + j] = (L^-1)_jk
  std::vector<std::size_t> panel_row;  // of the rows of R in the panel of the owner of a column
  const auto& nodes = symbolic_.supernodes;
  for (std::size_t index = nodes.size(); index-- > 0;) {
    const Supernode& s = nodes[index];
    double* panel = panels_.data() + s.panel;
    work.shape(static_cast<std::size_t>(s.below), static_cast<std::size_t>(s.width));
    const std::size_t u = work.u, w = work.w, up = work.up, wp = work.wp;
    invert_triangle(s, inverse);
    const std::size_t y = work.y, first = work.r;
    for (std::size_t c = 0; c < first; ++c) std::fill_n(work.column(c), work.lda, 0.0);
    for (std::size_t k = first; k < first + u; ++k) {
      std::fill_n(work.column(k), first, 0.0);
      std::fill_n(work.column(k) + first + u, up - u, 0.0);
    }
    sides.fill(s, panel, inverse, up, wp);
    multiply_by_inverse(kernels_, sides, work, threads);
    gather(s, work.column(first) + first, work.lda, panel_row);
    subtract_product(kernels_, work, first, first + up, y, y + w, threads);  // Z_RJ
    for (std::size_t j = 0; j < w; ++j) {
      const double* column = work.column(y + j) + first;
      for (std::size_t r = 0; r < u; ++r) work.column(first + r)[j] = column[r];
    }
    for (std::size_t b = 0; b < w; b += kColumns) {  // L_JJ^-T L_JJ^-1
      poll_cancelled();
      kernels_.product(sides.B.data(), sides.lda, w, up, up + wp, up + b,
                       up + std::min(w, b + kColumns), work.column(b) + y, work.lda);
    }
    subtract_product(kernels_, work, y, y + wp, 0, w, threads);  // Z_JJ
    for (std::size_t j = 0; j < w; ++j) {
      std::memcpy(panel + j * s.lda + s.top, work.column(y + j) + first, u * sizeof(double));
      for (std::size_t a = j; a < w; ++a) panel[j * s.lda + a] = work.column(j)[y + a];
    }
  }
}

/// inverse[j w + k] = (L_JJ^-1)_kj for k >= j: the columns of the inverse, one after another.
void SparseCholesky::invert_triangle(const Supernode& s, std::vector<double>& inverse) const {
  const auto w = static_cast<std::size_t>(s.width);
  const double* L = panels_.data() + s.panel;
  inverse.assign(w * w, 0);
  for (std::size_t j = 0; j < w; ++j) {
    if (j % kColumns == 0) poll_cancelled();
    double* x = &inverse[j * w];
    x[j] = 1;
    for (std::size_t k = j; k < w; ++k) {
      const double value = x[k] *= inverse_[static_cast<std::size_t>(s.first) + k];
      const double* column = L + k * s.lda;
      for (std::size_t i = k + 1; i < w; ++i) x[i] -= column[i] * value;
    }
  }
}

/// Z_RR, both triangles, into the first rows and columns.
void SparseCholesky::gather(const Supernode& s, double* A, std::size_t lda,
                            std::vector<std::size_t>& panel_row) const {
  const std::int32_t* rows = symbolic_.rows.data() + s.first_row;
  const auto u = static_cast<std::size_t>(s.below);
  panel_row.resize(u);
  for (std::size_t begin = 0; begin < u;) {
    const Supernode& owner = symbolic_.supernodes[symbolic_.owner[rows[begin]]];
    const std::int32_t* below = symbolic_.rows.data() + owner.first_row;
    std::size_t end = begin, at = 0;
    for (std::size_t i = begin; i < u; ++i) {
      if (rows[i] < owner.first + owner.width) {
        panel_row[i] = static_cast<std::size_t>(rows[i] - owner.first);
        end = i + 1;
        continue;
      }
      while (below[at] < rows[i]) ++at;
      panel_row[i] = owner.top + at;
    }
    for (std::size_t c = begin; c < end; ++c) {
      const double* from = panels_.data() + owner.panel +
                           static_cast<std::size_t>(rows[c] - owner.first) * owner.lda;
      double* to = A + c * lda;
      for (std::size_t i = c; i < u; ++i) to[i] = from[panel_row[i]];
    }
    begin = end;
  }
  for (std::size_t c = 0; c < u; ++c)
    for (std::size_t i = c + 1; i < u; ++i) A[i * lda + c] = A[c * lda + i];
}

}  // namespace sheaf
