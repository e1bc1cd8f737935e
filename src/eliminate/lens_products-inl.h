// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Sums of products between a lens and itself, and between a lens and an image of its own: of two
// rows each (eliminate/lens_kernels.h), over the runs of an image's observations.
#if defined(SHEAF_LINEAR_LENS_PRODUCTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_PRODUCTS_INL_H_
#undef SHEAF_LINEAR_LENS_PRODUCTS_INL_H_
#else
#define SHEAF_LINEAR_LENS_PRODUCTS_INL_H_
#endif

#include "eliminate/lens_blocks-inl.h"
#include "eliminate/lens_kernels.h"
#include "eliminate/products-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Two rows of nine: eight and, beside them, the ninths.
struct TwoRows {
  const double* eight;
  const double* ninth;
};
struct ImageRows {
  const Records& from;
  HWY_INLINE TwoRows at(std::uint16_t record) const {
    return {from.C + kCRecord * record, from.T + kTRecord * record + t_record::kC8};
  }
};
constexpr double kNoNinths[2] = {0, 0};
/// C of a lens's block, or G. Blocks of less than nine columns have no ninths in their records.
template <bool kG>
struct LensRows {
  const double* lens;
  std::size_t stride;
  bool nine_wide;
  HWY_INLINE TwoRows at(std::uint16_t record) const {
    const double* of = lens + stride * record;
    namespace at = lens_pair_record;
    return {of + (kG ? at::kG : at::kC), nine_wide ? of + (kG ? at::kG8 : at::kC8) : kNoNinths};
  }
};

/// sum left^T right: 8 x 8 (row-major), the ninth row, the ninth column, (8, 8).
struct RunSums {
  alignas(64) double square[64], row[8], column[8];
  double corner;
};

template <class Left, class Right>
HWY_INLINE void multiply_run(const std::uint16_t* records, std::uint32_t count, const Left& left,
                             const Right& right, RunSums& out) {
  out.corner = 0;
  for (int part = 0; part < kParts; ++part) {
    const int column = part * kLanes;
    V a[8], a8 = zero(), a9 = zero();
    for (V& x : a) x = zero();
    for (std::uint32_t i = 0; i < count; ++i) {
      const TwoRows l = left.at(records[i]), r = right.at(records[i]);
      for (int k = 0; k < 2; ++k) {
        const V vl = load(l.eight + 8 * k + column), vr = load(r.eight + 8 * k + column);
        outer8(l.eight + 8 * k, vl, vr, a);
        a8 = fma(set(l.ninth[k]), vr, a8);
        a9 = fma(set(r.ninth[k]), vl, a9);
      }
      if (part == 0) out.corner += l.ninth[0] * r.ninth[0] + l.ninth[1] * r.ninth[1];
    }
    for (int k = 0; k < 8; ++k) store(a[k], out.square + 8 * k + column);
    store(a8, out.row + column);
    store(a9, out.column + column);
  }
}

HWY_INLINE void take_from_tile(const RunSums& sums, double* tile) {
  for (int i = 0; i < 64; ++i) tile[i] -= sums.square[i];
  for (int i = 0; i < 8; ++i) {
    tile[tile_layout::kRow8 + i] -= sums.row[i];
    tile[tile_layout::kColumn8 + i] -= sums.column[i];
  }
  tile[tile_layout::kCorner] -= sums.corner;
}

/// The lens's right-hand side, sum C^T h; h stands in the images' records.
HWY_INLINE void add_right_side(const std::uint16_t* records, std::uint32_t count,
                               const LensRows<false>& C, const Records& from, double* block) {
  for (int part = 0; part < kParts; ++part) {
    const int column = part * kLanes;
    V sum = zero();
    for (std::uint32_t i = 0; i < count; ++i) {
      const double *c = C.at(records[i]).eight + column,
                   *h = from.T + kTRecord * records[i] + t_record::kH;
      sum = fma(set(h[0]), load(c), fma(set(h[1]), load(c + 8), sum));
    }
    add_to(sum, block + diagonal_layout::kRightSide + column);
  }
  double ninth = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double *c = C.at(records[i]).ninth, *h = from.T + kTRecord * records[i] + t_record::kH;
    ninth += c[0] * h[0] + c[1] * h[1];
  }
  block[diagonal_layout::kRightSide8] += ninth;
}

/// S_ll = sum C^T G: added to the lens's diagonal block.
HWY_INLINE void add_to_block(const RunSums& sums, double* block) {
  for (int i = 0; i < 64; ++i) block[i] += sums.square[i];
  for (int i = 0; i < 8; ++i) block[diagonal_layout::kRow8 + i] += sums.row[i];
  block[diagonal_layout::kCorner] += sums.corner;
}

/// What T_l took from the squares of the lens's columns, as diagonal blocks say it.
inline void add_slot_squares(const LensTracks& tracks, const Chunk& chunk, const double* T,
                             double* diagonal) {
  const std::uint64_t first = tracks.first_slot[chunk.first_group];
  const double* t = T + kTRecord * 8 * (chunk.end_batch - chunk.first_batch);
  for (std::uint64_t at = 8 * first; at < 8 * tracks.first_slot[chunk.end_group];
       ++at, t += kTRecord) {
    if (tracks.slot_block[at] < 0) continue;
    double* block = diagonal + kDiagonalDoubles * static_cast<std::size_t>(tracks.slot_block[at]);
    const auto square3 = [](double x, double y, double z) { return x * x + y * y + z * z; };
    for (int i = 0; i < 8; ++i)
      block[diagonal_layout::kSquares + i] += square3(
          t[t_record::column(0) + i], t[t_record::column(1) + i], t[t_record::column(2) + i]);
    const double* last = t + t_record::kRow8;
    block[diagonal_layout::kSquares8] += square3(last[0], last[1], last[2]);
  }
}

/// As pair_products, of blocks that are poses alone: six rows, and columns in two chains, so that
/// one product need not wait for another's sum.
inline void pose_pair_products(const Chunks& chunks, const Chunk& chunk, const Records& from,
                               double* tiles) {
  for (std::uint64_t r = chunk.first_pair_run; r < chunk.end_pair_run; ++r) {
    const PairRun run = chunks.pair_runs[r];
    const RecordPair* pairs = &chunks.pairs[run.first];
    double* tile = tiles + kTileDoubles * run.tile;
    for (int column = 0; column < 8; column += kLanes) {
      V even[6], odd[6];
      for (int k = 0; k < 6; ++k) even[k] = odd[k] = zero();
      for (std::uint32_t i = 0; i < run.count; ++i) {
        const double* a = from.T + kTRecord * pairs[i].a;
        const double* b = from.T + kTRecord * pairs[i].b;
        for (int q = 0; q < 3; ++q) {
          V* to = q == 1 ? odd : even;
          const V v = load(b + t_record::column(q) + column),
                  loaded = load(a + t_record::column(q) + column);
          to[0] = fma(broadcast<0>(a + t_record::column(q), loaded), v, to[0]);
          to[1] = fma(broadcast<1>(a + t_record::column(q), loaded), v, to[1]);
          to[2] = fma(broadcast<2>(a + t_record::column(q), loaded), v, to[2]);
          to[3] = fma(broadcast<3>(a + t_record::column(q), loaded), v, to[3]);
          to[4] = fma(broadcast<4>(a + t_record::column(q), loaded), v, to[4]);
          to[5] = fma(broadcast<5>(a + t_record::column(q), loaded), v, to[5]);
        }
      }
      for (int k = 0; k < 6; ++k) add_to(hn::Add(even[k], odd[k]), tile + 8 * k + column);
    }
  }
}

inline void lens_products(const LensTracks& tracks, const LensTiles& tiles_of, const Chunks& chunks,
                          const Chunk& chunk, const LensRecords& from, double* diagonal,
                          double* tiles) {
  if (const BlockSums blocks(tracks, from.blocks); blocks) return blocks.flush(diagonal);
  const std::size_t stride = kLensPairRecord * static_cast<std::size_t>(tracks.most_blocks);
  const ImageRows image_rows{from.image};
  RunSums sums;
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun run = chunks.diagonal_runs[i];
    const std::uint16_t* records = &chunks.diagonal[run.first];
    const std::uint32_t lens = tracks.image_lens[run.image];
    const LensPlaces& places = tracks.lenses[lens];
    for (std::uint32_t j = 0; j < places.blocks; ++j) {
      const bool nine_wide = tracks.most_width[j] == 9;
      const LensRows<false> C{from.lens + kLensPairRecord * j, stride, nine_wide};
      const LensRows<true> G{from.lens + kLensPairRecord * j, stride, nine_wide};
      if (!tiles_of.of_image.empty()) {
        multiply_run(records, run.count, G, image_rows, sums);
        take_from_tile(sums, tiles + kTileDoubles * tiles_of.of_image[2 * run.image + j]);
      }
      double* block = diagonal + kDiagonalDoubles * (places.first_block + j);
      multiply_run(records, run.count, C, G, sums);
      add_to_block(sums, block);
      add_right_side(records, run.count, C, from.image, block);
      if (j == 0 || tiles_of.of_lens.empty()) continue;
      const LensRows<true> G0{from.lens, stride, tracks.most_width[0] == 9};
      multiply_run(records, run.count, C, G0, sums);
      take_from_tile(sums, tiles + kTileDoubles * tiles_of.of_lens[lens]);
    }
  }
  if (tracks.most_blocks > 0) add_slot_squares(tracks, chunk, from.image.T, diagonal);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
