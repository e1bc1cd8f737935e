// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string_view>

#include "platform/buffer.h"
#include "platform/dispatch.h"
#include "rows/photometric.h"
#include "rows/reference_patch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "rows/photometric_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "rows/loss_lanes-inl.h"
#include "rows/patch_rows-inl.h"
#include "rows/patch_sums-inl.h"
#include "rows/rows-inl.h"
#include "rows/translated_patches-inl.h"
#include "rows/warped_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

static_assert(kRowBatch == row_field::kCount * kLanes * kParts);

template <bool kBrightness>
HWY_INLINE Whitened whiten(const V* sums, double* brightness) {
  Whitened w;
  const V none = zero();
  const auto first = hn::Gt(sums[kGxx], set(kNoTexture));
  const V i1 = hn::IfThenElse(first, hn::Div(set(1.0), hn::Sqrt(sums[kGxx])), none);
  w.r11 = hn::Mul(sums[kGxx], i1);
  w.r12 = hn::Mul(sums[kGxy], i1);
  w.h[0] = hn::Mul(sums[kGxr], i1);
  const V left = fnma(w.r12, w.r12, sums[kGyy]);
  const auto second = hn::Gt(left, fma(set(kRoundedPivot), sums[kGyy], set(kNoTexture)));
  const V i2 = hn::IfThenElse(second, hn::Div(set(1.0), hn::Sqrt(left)), none);
  w.r22 = hn::Mul(left, i2);
  w.h[1] = hn::Mul(fnma(w.r12, w.h[0], sums[kGyr]), i2);
  w.alpha[0] = w.alpha[1] = w.beta[0] = w.beta[1] = none;
  if constexpr (kBrightness) {
    w.alpha[0] = hn::Neg(hn::Mul(sums[kGxg], i1));
    w.beta[0] = hn::Neg(hn::Mul(sums[kGx1], i1));
    w.alpha[1] = hn::Mul(hn::Neg(fma(w.r12, w.alpha[0], sums[kGyg])), i2);
    w.beta[1] = hn::Mul(hn::Neg(fma(w.r12, w.beta[0], sums[kGy1])), i2);
    const V *a = w.alpha, *b = w.beta, *h = w.h;
    const V rest[5] = {fnma(a[0], a[0], fnma(a[1], a[1], sums[kGg])),
                       fnma(a[0], b[0], fnma(a[1], b[1], sums[kG1])),
                       fnma(b[0], b[0], fnma(b[1], b[1], sums[k11])),
                       hn::Neg(fma(a[0], h[0], fma(a[1], h[1], sums[kGr]))),
                       hn::Neg(fma(b[0], h[0], fma(b[1], h[1], sums[k1r])))};
    for (int i = 0; i < 5; ++i) store(rest[i], brightness + 8 * i);
  }
  return w;
}

struct CollapseSums {
  V cost[kParts], square[kParts];
  std::uint64_t left = 0;
};

/// The parts of batches in order: group by group, part by part.
struct Walk {
  const Batches& batches;
  std::uint32_t group, end;
  int part = 0;
  std::uint64_t batch = 0;

  Walk(const Batches& of, std::uint32_t first_group, std::uint32_t end_group)
      : batches(of), group(first_group), end(end_group) {
    if (!done()) batch = here().first_batch;
  }
  bool done() const { return group == end; }
  const Batches::Group& here() const { return batches.groups[group]; }
  bool begins_points() const { return batch == here().first_batch; }
  int lane() const { return part * kLanes; }
  void advance() {
    if (++batch < here().first_batch + here().track) return;
    if (++part == kParts) part = 0, ++group;
    if (!done()) batch = here().first_batch;
  }
};

/// What is known of a part of a batch before its pixels are read.
struct Aim {
  Place at;
  V alpha, beta;
  TranslatedLanes pixels;  ///< of patches that are not warped
};

HWY_INLINE PatchLanes lanes_at(const Walk& walk, V alpha, V beta) {
  const Batches& batches = walk.batches;
  const int lane = walk.lane();
  return {std::clamp(static_cast<int>(walk.here().lanes) - lane, 0, kLanes),
          lane_mask(walk.here().lanes, lane),
          &batches.lane_point[8 * std::size_t(walk.group) + lane],
          &batches.image[8 * walk.batch + lane],
          batches.uniform[walk.batch] >= 0,
          alpha,
          beta};
}

template <bool kRays>
HWY_INLINE void aim(const PhotometricInput& in, const Walk& walk, const PhotometricOutput& out,
                    Aim& to) {
  V c[8 * view_record::kOctets];
  load_state<view_record::kOctets, kViewRecord>(in.views,
                                                &walk.batches.image[8 * walk.batch + walk.lane()],
                                                walk.batches.uniform[walk.batch], c);
  const LanePoints X = load_points<kRays>(in, walk.group, walk.lane());
  to.at = place_points(in.camera, c, X.d, X.s);
  to.alpha = c[view_record::kAlpha], to.beta = c[view_record::kBeta];
  double* seen = out.seen + 16 * walk.batch + walk.lane();
  if (kRays && in.warped)
    store(to.at.x, seen), store(to.at.y, seen + 8);
  else
    to.pixels.find(in, lanes_at(walk, to.alpha, to.beta), to.at, seen);
}

/// The patches of one batch's part.
template <bool kBrightness, bool kRays>
HWY_INLINE void collapse_part(const PhotometricInput& in, const Walk& walk, Aim& aim,
                              double* scratch, const PhotometricOutput& out, CollapseSums& sums) {
  const std::uint64_t b = walk.batch;
  const int lane = walk.lane(), part = walk.part;
  V of[kPatchSums<kBrightness>];
  double* inside = aim.pixels.inside;
  if (kRays && in.warped) {
    sums.left += sum_warped_lanes<kBrightness>(in, lanes_at(walk, aim.alpha, aim.beta), aim.at,
                                               out.seen + 16 * b + lane, inside, scratch, of);
  } else {
    sums.left += aim.pixels.left;
    sum_translated_lanes<kBrightness>(in, aim.pixels, aim.at, aim.alpha, aim.beta, scratch, of);
  }
  V cost = of[kCost];
  if (in.loss_per_patch) cost = apply_patch_loss<kBrightness>(in.loss, of);
  V square = of[kSquare];
  const auto fits = hn::Gt(load(inside), zero());
  const bool all_fit = hn::AllTrue(D(), fits);
  if (!all_fit && in.leaving != nullptr) {
    const V away = hn::IfThenZeroElse(fits, lane_mask(walk.here().lanes, lane));
    const double* leaving = in.leaving + 16 * b + lane;
    cost = hn::Add(hn::IfThenElseZero(fits, cost), hn::Mul(load(leaving), away));
    square = hn::Add(square, hn::Mul(load(leaving + 8), away));
  }
  if (out.costs != nullptr) {
    double* costs = out.costs + 16 * b + lane;
    store(cost, costs), store(square, costs + 8);
  }
  sums.cost[part] = hn::Add(sums.cost[part], cost);
  sums.square[part] = hn::Add(sums.square[part], square);
  const Whitened w = whiten<kBrightness>(of, out.brightness + kBrightnessBatch * b + lane);
  if (out.factors != nullptr)
    save_factors<kBrightness>(w, out.factors + patch_factors(kBrightness) * b + lane);
  if (out.rows == nullptr) return;
  V c[8 * view_record::kOctets];
  load_state<view_record::kOctets, kViewRecord>(in.views, &walk.batches.image[8 * b + lane],
                                                walk.batches.uniform[b], c);
  const LanePoints X = load_points<kRays>(in, walk.group, lane);
  LaneJacobian j = rows_of<kRays>(w, in.camera, c, aim.at, X.s);
  if (!all_fit) zero_rows(fits, j);
  save(j, out.rows + kRowBatch * b + row_field::kCount * kLanes * part);
}

/// Where the next patches' pixels are is known, and they are asked for, before those of the ones at
/// hand are read.
template <bool kBrightness, bool kRays>
void collapse_groups(const PhotometricInput& in, std::uint32_t first, std::uint32_t end,
                     PhotometricOutput& out) {
  Buffer<double> scratch;  // sums of warped patches; references of others
  const bool warped = kRays && in.warped;
  scratch.allocate(warped ? kSumScratch : kLanes * (in.grid->area() + 1));
  CollapseSums sums;
  for (int p = 0; p < kParts; ++p) sums.cost[p] = sums.square[p] = zero();
  Aim aims[2];
  const std::size_t window = warped ? 0 : TranslatedLanes::window_floats(*in.grid);
  Buffer<float> windows(2 * window);
  for (std::size_t k = 0; k < 2; ++k) aims[k].pixels.windows = windows.data() + k * window;
  Walk walk(*in.batches, first, end), next = walk;
  if (!next.done()) aim<kRays>(in, next, out, aims[0]);
  for (int turn = 0; !walk.done(); walk.advance(), turn ^= 1) {
    next.advance();
    if (!next.done()) aim<kRays>(in, next, out, aims[turn ^ 1]);
    if (!warped && walk.begins_points())
      spread_references(in, walk.here(), walk.group, walk.part, scratch.data());
    collapse_part<kBrightness, kRays>(in, walk, aims[turn], scratch.data(), out, sums);
  }
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(sums.cost[p], lanes + p * kLanes);
  out.cost += sum8(lanes);
  for (int p = 0; p < kParts; ++p) store(sums.square[p], lanes + p * kLanes);
  out.square_sum += sum8(lanes);
  out.left += sums.left;
}

void collapse(const PhotometricInput& in, std::uint32_t first, std::uint32_t end,
              PhotometricOutput& out) {
  if (in.rays != nullptr)
    (in.brightness ? collapse_groups<true, true> : collapse_groups<false, true>)(in, first, end,
                                                                                 out);
  else
    (in.brightness ? collapse_groups<true, false> : collapse_groups<false, false>)(in, first, end,
                                                                                   out);
}

constexpr PhotometricKernels photometric_table() { return {set_name(HWY_TARGET), &collapse}; }

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const PhotometricKernels& photometric_kernels(const char* simd_name) {
  if (std::string_view(simd_name) == "scalar") return reference_photometric_kernels();
  static constexpr PhotometricKernels tables[] = SHEAF_TABLES(photometric_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
