// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// y += (U - W (V + D)^-1 W^T) x over the blocks of images and lenses, nothing formed: the rows of a
// group are computed again and stay in the first-level cache for both sweeps.
#if defined(SHEAF_LINEAR_LENS_PRODUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#undef SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#else
#define SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#endif

#include "linear/lens_eliminate-inl.h"
#include "linear/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The blocks j of the lanes' lenses; -1: the lens has none.
struct LensBlocks {
  std::int32_t of_lane[8];
  bool uniform = false;

  HWY_INLINE LensBlocks(const LensTracks& tracks, std::uint64_t batch, int j) {
    uniform = tracks.uniform_lens[batch] >= 0;
    for (int l = 0; l < (uniform ? 1 : 8); ++l) {
      const LensPlaces& lens = tracks.lenses[tracks.lens[8 * batch + static_cast<std::size_t>(l)]];
      of_lane[l] = j < lens.blocks ? static_cast<std::int32_t>(lens.first_block) + j : -1;
    }
  }
};

/// Nine of a block's numbers, kProductRecord apart, for the lanes of a part; 0 where there is none.
HWY_INLINE void load_block(const double* x, const LensBlocks& blocks, int lane, V* out) {
  if (blocks.uniform) {
    const std::int32_t block = blocks.of_lane[0];
    for (int i = 0; i < 9; ++i)
      out[i] = block < 0 ? zero() : set(x[kProductRecord * static_cast<std::size_t>(block) + i]);
    return;
  }
  for (int i = 0; i < 9; ++i) {
    alignas(64) double lanes[8];
    for (int l = 0; l < kLanes; ++l) {
      const std::int32_t block = blocks.of_lane[lane + l];
      lanes[l] = block < 0 ? 0 : x[kProductRecord * static_cast<std::size_t>(block) + i];
    }
    out[i] = load(lanes);
  }
}

HWY_INLINE void load_image(const double* x, const std::uint32_t* image, std::int32_t uniform,
                           V* out) {
  if (uniform >= 0) {
    const double* of = x + kProductRecord * static_cast<std::size_t>(uniform);
    for (int i = 0; i < 9; ++i) out[i] = set(of[i]);
    return;
  }
  load_records(x, kProductRecord, image, out);
  alignas(64) double last[8];
  for (int l = 0; l < kLanes; ++l) last[l] = x[kProductRecord * image[l] + 8];
  out[8] = load(last);
}

/// The rows' scale: the root of the loss's weight, 0 in masked lanes.
HWY_INLINE V row_scale(const LensProductInput& in, std::uint64_t batch, int lane, V mask) {
  if (in.weights == nullptr) return mask;
  return hn::Mul(mask, hn::Sqrt(load(in.weights + 8 * batch + lane)));
}

/// e = Jc x of a part's observation, whose rows go to `row`, with e where residuals stand; and
/// s += Jp^T e.
HWY_INLINE void first_lens_sweep(const LensProductInput& in, std::uint64_t batch, int lane,
                                 const V* X, V scale, double* row, V* s) {
  const LensTracks& tracks = *in.of.tracks;
  double* lens = row + kJacobianFields * kLanes;
  LaneJacobian j = lens_rows(in.of, batch, lane, X, lens);
  V x[9], e[2];
  load_image(in.x, &in.of.batches->image[8 * batch + lane], in.of.batches->uniform[batch], x);
  for (int r = 0; r < 2; ++r) {
    e[r] = hn::Mul(j.camera[r][0], x[0]);
    for (int i = 1; i < 9; ++i) e[r] = fma(j.camera[r][i], x[i], e[r]);
  }
  for (int b = 0; b < tracks.most_blocks; ++b) {
    load_block(in.x, LensBlocks(tracks, batch, b), lane, x);
    for (int r = 0; r < 2; ++r)
      for (int i = 0; i < 9; ++i) e[r] = fma(load(lens + kLanes * lens_field(b, r, i)), x[i], e[r]);
  }
  // Of the two factors of each product of rows, one takes the whole weight.
  scale = hn::Mul(scale, scale);
  for (int r = 0; r < 2; ++r) j.r[r] = hn::Mul(e[r], scale);
  for (int i = 0; i < 3; ++i) s[i] = fma(j.point[0][i], j.r[0], fma(j.point[1][i], j.r[1], s[i]));
  save(j, row);
}

/// v = Jc^T (e - w Jp u) of a part's observation: the image's nine, then nine for each block.
HWY_INLINE void second_lens_sweep(const double* row, int blocks, V scale, const V* u, V* v) {
  V e[2];
  scale = hn::Mul(scale, scale);
  for (int r = 0; r < 2; ++r) {
    V along = zero();
    for (int i = 0; i < 3; ++i) along = fma(load(row + (20 + 3 * r + i) * kLanes), u[i], along);
    e[r] = fnma(scale, along, load(row + r * kLanes));
  }
  for (int i = 0; i < 9; ++i)
    v[i] = fma(load(row + (2 + i) * kLanes), e[0], hn::Mul(load(row + (11 + i) * kLanes), e[1]));
  const double* lens = row + kJacobianFields * kLanes;
  for (int b = 0; b < blocks; ++b)
    for (int i = 0; i < 9; ++i)
      v[9 + 9 * b + i] = fma(load(lens + kLanes * lens_field(b, 0, i)), e[0],
                             hn::Mul(load(lens + kLanes * lens_field(b, 1, i)), e[1]));
}

HWY_INLINE void scatter_to_lenses(const double* rows, const double* ninth, const LensBlocks& blocks,
                                  double* sums) {
  if (blocks.uniform) {
    if (blocks.of_lane[0] >= 0) scatter(rows, ninth, nullptr, blocks.of_lane[0], sums);
    return;
  }
  for (int l = 0; l < 8; ++l) {
    if (blocks.of_lane[l] < 0) continue;
    double* to = sums + kProductRecord * static_cast<std::size_t>(blocks.of_lane[l]);
    for (int i = 0; i < 8; ++i) to[i] += rows[8 * l + i];
    to[8] += ninth[l];
  }
}

inline void lens_product_group(const LensProductInput& in, std::size_t g, double* saved,
                               double* sums) {
  const Batches& batches = *in.of.batches;
  const LensTracks& tracks = *in.of.tracks;
  const Batches::Group& group = batches.groups[g];
  const int blocks = tracks.most_blocks;
  const std::size_t part_doubles = row_fields(tracks) * kLanes;
  V u[kParts][3];
  for (int part = 0; part < kParts; ++part) {
    const int lane = part * kLanes;
    const double* at = in.of.at.points + kPointGroup * g + lane;
    const V X[3] = {load(at), load(at + 8), load(at + 16)};
    const V mask = lane_mask(group.lanes, lane);
    V s[3] = {zero(), zero(), zero()};
    for (std::uint32_t o = 0; o < group.track; ++o)
      first_lens_sweep(in, group.first_batch + o, lane, X,
                       row_scale(in, group.first_batch + o, lane, mask),
                       saved + part_doubles * (kParts * o + part), s);
    solve_point(in.factors + kFactorGroup * g + lane, s, u[part]);
  }
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    alignas(64) double rows[3][64], ninth[3][8];
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      V v[27];
      second_lens_sweep(saved + part_doubles * (kParts * o + part), blocks,
                        row_scale(in, b, lane, lane_mask(group.lanes, lane)), u[part], v);
      for (int k = 0; k <= blocks; ++k) {
        store_records(v + 9 * k, rows[k] + 8 * lane, 8);
        store(v[9 * k + 8], ninth[k] + lane);
      }
    }
    scatter(rows[0], ninth[0], &batches.image[8 * b], batches.uniform[b], sums);
    for (int k = 0; k < blocks; ++k)
      scatter_to_lenses(rows[k + 1], ninth[k + 1], LensBlocks(tracks, b, k), sums);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
