// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Sums of products over the records of a chunk: the diagonal blocks and right-hand side of the
// reduced camera system, and its off-diagonal blocks. A block is 8 + 1 columns: eight in a vector,
// the ninth beside it. Accumulators stay in registers over a run of records of one image (pair).
#if defined(SHEAF_LINEAR_PRODUCTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_PRODUCTS_INL_H_
#undef SHEAF_LINEAR_PRODUCTS_INL_H_
#else
#define SHEAF_LINEAR_PRODUCTS_INL_H_
#endif

#include "eliminate/kernels.h"
#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// a[k] += x[k] v for k < 8, where x is an eight-double record and `loaded` its register.
HWY_INLINE void outer8(const double* x, V loaded, V v, V* a) {
  a[0] = fma(broadcast<0>(x, loaded), v, a[0]);
  a[1] = fma(broadcast<1>(x, loaded), v, a[1]);
  a[2] = fma(broadcast<2>(x, loaded), v, a[2]);
  a[3] = fma(broadcast<3>(x, loaded), v, a[3]);
  a[4] = fma(broadcast<4>(x, loaded), v, a[4]);
  a[5] = fma(broadcast<5>(x, loaded), v, a[5]);
  a[6] = fma(broadcast<6>(x, loaded), v, a[6]);
  a[7] = fma(broadcast<7>(x, loaded), v, a[7]);
}

/// Columns of this part of one image's diagonal block, and of its right-hand side. The squares of
/// the ninths (T in lanes 0..2, C in lanes 4 and 5) go to `ninths`.
HWY_INLINE void diagonal_part(const std::uint16_t* records, std::uint32_t count, int part,
                              const Records& from, double* sums, double* ninths) {
  const int column = part * kLanes;
  V a[8], a8 = zero(), rhs = zero(), squares = zero(), ninth = zero();
  for (V& x : a) x = zero();
  for (std::uint32_t i = 0; i < count; ++i) {
    const double* c = from.C + kCRecord * records[i];
    const double* t = from.T + kTRecord * records[i];
    const V c0 = load(c + column), c1 = load(c + c_record::row(1) + column);
    outer8(c, c0, c0, a);
    outer8(c + c_record::row(1), c1, c1, a);
    const double *c8 = t + t_record::kC8, *h = t + t_record::kH;
    a8 = fma(set(c8[0]), c0, fma(set(c8[1]), c1, a8));
    rhs = fma(set(h[0]), c0, fma(set(h[1]), c1, rhs));
    const V t0 = load(t + t_record::column(0) + column),
            t1 = load(t + t_record::column(1) + column),
            t2 = load(t + t_record::column(2) + column);
    squares = fma(t0, t0, fma(t1, t1, fma(t2, t2, squares)));
    const V last = load(t + t_record::kRow8 + column);
    ninth = fma(last, last, ninth);
  }
  for (int k = 0; k < 8; ++k) add_to(a[k], sums + 8 * k + column);
  add_to(a8, sums + diagonal_layout::kRow8 + column);
  add_to(rhs, sums + diagonal_layout::kRightSide + column);
  add_to(squares, sums + diagonal_layout::kSquares + column);
  store(ninth, ninths + column);
}

HWY_INLINE void diagonal_run(const std::uint16_t* records, std::uint32_t count, const Records& from,
                             double* sums) {
  alignas(64) double ninths[8];
  for (int p = 0; p < kParts; ++p) diagonal_part(records, count, p, from, sums, ninths);
  double rhs = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double* t = from.T + kTRecord * records[i];
    const double *c8 = t + t_record::kC8, *h = t + t_record::kH;
    rhs += c8[0] * h[0] + c8[1] * h[1];
  }
  constexpr int kC8 = t_record::kC8 - t_record::kRow8;
  sums[diagonal_layout::kCorner] += ninths[kC8] + ninths[kC8 + 1];
  sums[diagonal_layout::kRightSide8] += rhs;
  sums[diagonal_layout::kSquares8] += ninths[0] + ninths[1] + ninths[2];
}

/// Without lists: the records in their own order, eight at a time where one image has all lanes.
inline void diagonal_in_order(const Batches& batches, const Chunk& chunk, const Records& from,
                              double* sums) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      // Counted from the batch: from the chunk, a long track's would not fit into 16 bits.
      constexpr std::uint16_t kRecords[8] = {0, 1, 2, 3, 4, 5, 6, 7};
      const std::uint64_t record = 8 * (b - chunk.first_batch);
      const Records batch{from.T + kTRecord * record, from.C + kCRecord * record, nullptr};
      const bool uniform = batches.uniform[b] >= 0;
      const std::uint32_t count = uniform ? group.lanes : 1;
      for (std::uint32_t l = 0; l < group.lanes; l += count) {
        double* to = sums + kDiagonalDoubles * batches.image[8 * b + l];
        diagonal_run(kRecords + l, count, batch, to);
      }
    }
  }
}

inline void diagonal_products(const Batches& batches, const Chunks& chunks, const Chunk& chunk,
                              const Records& from, double* sums) {
  if (chunks.diagonal.size() == 0) return diagonal_in_order(batches, chunk, from, sums);
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun run = chunks.diagonal_runs[i];
    diagonal_run(&chunks.diagonal[run.first], run.count, from, sums + kDiagonalDoubles * run.image);
  }
}

/// tile += sum T_a T_b^T, columns of this part (and rows of this part of the ninth column). The
/// ninths' own products, of which lanes 0..2 are wanted, go to `corner`.
HWY_INLINE void pair_part(const RecordPair* pairs, std::uint32_t count, int part, const double* T,
                          double* tile, double* corner) {
  const int column = part * kLanes;
  V a[8], a8 = zero(), a9 = zero(), ninths = zero();
  for (V& x : a) x = zero();
  for (std::uint32_t i = 0; i < count; ++i) {
    const double* ti = T + kTRecord * pairs[i].a;
    const double* tj = T + kTRecord * pairs[i].b;
    for (int q = 0; q < 3; ++q) {
      const int of = t_record::column(q);
      const V vi = load(ti + of + column), vj = load(tj + of + column);
      outer8(ti + of, vi, vj, a);
      a8 = fma(set(ti[t_record::kRow8 + q]), vj, a8);
      a9 = fma(set(tj[t_record::kRow8 + q]), vi, a9);
    }
    ninths = fma(load(ti + t_record::kRow8 + column), load(tj + t_record::kRow8 + column), ninths);
  }
  for (int k = 0; k < 8; ++k) add_to(a[k], tile + 8 * k + column);
  add_to(a8, tile + tile_layout::kRow8 + column);
  add_to(a9, tile + tile_layout::kColumn8 + column);
  store(ninths, corner + column);
}

inline void pair_products(const Chunks& chunks, const Chunk& chunk, const Records& from,
                          double* tiles) {
  for (std::uint64_t i = chunk.first_pair_run; i < chunk.end_pair_run; ++i) {
    const PairRun run = chunks.pair_runs[i];
    const RecordPair* pairs = &chunks.pairs[run.first];
    double* tile = tiles + kTileDoubles * run.tile;
    alignas(64) double corner[8];
    for (int p = 0; p < kParts; ++p) pair_part(pairs, run.count, p, from.T, tile, corner);
    tile[tile_layout::kCorner] += corner[0] + corner[1] + corner[2];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
