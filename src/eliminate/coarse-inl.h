// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The coarse matrix's sums from the records of elimination. With H_a = T_a^T Z_i (3 x 8) of an
// observation and H_c the sum over a cluster's, a point adds H_c^T H_d to the pair (c, d), less
// H_a^T H_a of its observations to (c, c). The eight lanes are the modes.
#if defined(SHEAF_LINEAR_COARSE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_COARSE_INL_H_
#undef SHEAF_LINEAR_COARSE_INL_H_
#else
#define SHEAF_LINEAR_COARSE_INL_H_
#endif

#include <algorithm>

#include "eliminate/kernels.h"
#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// H = T^T Z, three rows of eight modes.
HWY_INLINE void project(const double* T, const double* Z, double* H) {
  for (int part = 0; part < 8; part += kLanes) {
    V h[3];
    V z = load(Z + part);
    for (int q = 0; q < 3; ++q) h[q] = hn::Mul(set(T[t_record::column(q)]), z);
    for (int r = 1; r < 7; ++r) {
      z = load(Z + 8 * r + part);
      for (int q = 0; q < 3; ++q) h[q] = fma(set(T[t_record::column(q) + r]), z, h[q]);
    }
    for (int q = 0; q < 3; ++q) store(h[q], H + 8 * q + part);
  }
}

/// tile += sign A^T B.
template <bool kSubtract>
HWY_INLINE void add_outer(const double* A, const double* B, double* tile) {
  for (int part = 0; part < 8; part += kLanes) {
    const V b0 = load(B + part), b1 = load(B + 8 + part), b2 = load(B + 16 + part);
    for (int m = 0; m < 8; ++m) {
      double* to = tile + 8 * m + part;
      V sum = load(to);
      if constexpr (kSubtract)
        sum = fnma(set(A[m]), b0, fnma(set(A[8 + m]), b1, fnma(set(A[16 + m]), b2, sum)));
      else
        sum = fma(set(A[m]), b0, fma(set(A[8 + m]), b1, fma(set(A[16 + m]), b2, sum)));
      store(sum, to);
    }
  }
}

HWY_INLINE double* coarse_tile(const CoarseInput& in, std::int32_t row, std::int32_t column,
                               double* sums) {
  const std::size_t at = static_cast<std::size_t>(row) * (row + 1) / 2 + column;
  return sums + kCoarseTile * static_cast<std::size_t>(in.tile[at]);
}

/// What one point's track touches: each cluster, how many of the observations are in it, and the
/// sum of their H.
struct TouchedClusters {
  double* H;  ///< 24 of each
  std::int32_t *cluster, *count;
  std::size_t size = 0;

  HWY_INLINE std::size_t slot(std::int32_t c) {
    for (std::size_t s = 0; s < size; ++s)
      if (cluster[s] == c) return s;
    cluster[size] = c;
    count[size] = 0;
    std::fill_n(H + 24 * size, 24, 0.0);
    return size++;
  }
};

/// One point: its observations' records stand 8 apart, from `record` on. A cluster that sees it
/// once has no pair of its own.
HWY_INLINE void coarse_point(const Batches& batches, const Batches::Group& group, std::uint32_t l,
                             std::size_t record, const Records& records, const CoarseInput& in,
                             TouchedClusters& touched, double* sums) {
  touched.size = 0;
  const std::uint32_t* image = &batches.image[8 * group.first_batch + l];
  for (std::uint32_t o = 0; o < group.track; ++o)
    if (const std::int32_t c = in.cluster[image[8 * o]]; c >= 0) ++touched.count[touched.slot(c)];
  if (touched.size == 0 || (touched.size == 1 && touched.count[0] == 1)) return;
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::int32_t c = in.cluster[image[8 * o]];
    if (c < 0) continue;
    alignas(64) double H[24];
    project(records.T + kTRecord * (record + 8 * o), in.basis + kCoarseBasis * image[8 * o], H);
    const std::size_t s = touched.slot(c);
    for (int i = 0; i < 24; i += kLanes) add_to(load(H + i), touched.H + 24 * s + i);
    if (touched.count[s] > 1) add_outer<true>(H, H, coarse_tile(in, c, c, sums));
  }
  for (std::size_t a = 0; a < touched.size; ++a)
    for (std::size_t b = 0; b < touched.size; ++b) {
      const std::int32_t row = touched.cluster[a], column = touched.cluster[b];
      if (row > column || (row == column && touched.count[a] > 1))
        add_outer<false>(touched.H + 24 * a, touched.H + 24 * b,
                         coarse_tile(in, row, column, sums));
    }
}

inline void coarse_products(const Batches& batches, const Chunk& chunk, const Records& records,
                            const CoarseInput& in, double* scratch, double* sums) {
  const std::size_t most = coarse_scratch_clusters(batches, in.clusters);
  auto* numbers = reinterpret_cast<std::int32_t*>(scratch + 24 * most);
  TouchedClusters touched{scratch, numbers, numbers + most};
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    const std::size_t record = 8 * (group.first_batch - chunk.first_batch);
    for (std::uint32_t l = 0; l < group.lanes; ++l)
      coarse_point(batches, group, l, record + l, records, in, touched, sums);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
