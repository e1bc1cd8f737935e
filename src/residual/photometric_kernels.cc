// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <string_view>

#include "platform/buffer.h"
#include "platform/simd_targets.h"
#include "residual/photometric.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "residual/photometric_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "residual/loss_lanes-inl.h"
#include "residual/patch_sums-inl.h"
#include "residual/rows-inl.h"
#include "residual/translated_patches-inl.h"
#include "residual/warped_patches-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

static_assert(kRowBatch == kJacobianFields * kLanes * kParts);

/// Squared slopes of a patch, summed, below which there is no texture: where an image is saturated
/// they are some 1e-28, and points that see nothing else would step by noise over noise.
constexpr double kNoTexture = 1e-12;

/// The first two rows of the Cholesky factor of the Gram matrix of (gx, gy, -g, -1), and as much
/// of the residual: G = R^T R, R h = G^T r. A pivot that is rounding leaves a row of zeros.
struct Whitened {
  V r11, r12, r22, alpha[2], beta[2], h[2];
};

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
  const auto second = hn::Gt(left, fma(set(1e-12), sums[kGyy], set(kNoTexture)));
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

/// The rows' Jacobians. With A = R du/dP: by rho s A, by phi P x A (row by row), by the world point
/// A R, by the inverse depth A t.
template <bool kRays>
HWY_INLINE LaneJacobian rows_of(const Whitened& w, const Pinhole& camera, const V* c,
                                const Place& at, V s) {
  const V fx = hn::Mul(set(camera.fx), at.iz), fy = hn::Mul(set(camera.fy), at.iz);
  const V px = hn::Mul(at.P[0], at.iz), py = hn::Mul(at.P[1], at.iz);
  const V a[2][2] = {{hn::Mul(w.r11, fx), hn::Mul(w.r12, fy)}, {zero(), hn::Mul(w.r22, fy)}};
  LaneJacobian j;
  for (int r = 0; r < 2; ++r) {
    const V a0 = a[r][0], a1 = a[r][1], a2 = hn::Neg(fma(a0, px, hn::Mul(a1, py)));
    j.r[r] = w.h[r];
    V* to = j.camera[r];
    to[0] = hn::Mul(s, a0), to[1] = hn::Mul(s, a1), to[2] = hn::Mul(s, a2);
    to[3] = fms(a2, at.P[1], hn::Mul(a1, at.P[2]));
    to[4] = fms(a0, at.P[2], hn::Mul(a2, at.P[0]));
    to[5] = fms(a1, at.P[0], hn::Mul(a0, at.P[1]));
    to[6] = w.alpha[r], to[7] = w.beta[r], to[8] = zero();
    if constexpr (kRays) {
      j.point[r][0] = fma(a0, c[9], fma(a1, c[10], hn::Mul(a2, c[11])));
      j.point[r][1] = j.point[r][2] = zero();
    } else {
      for (int i = 0; i < 3; ++i)
        j.point[r][i] = fma(a0, c[i], fma(a1, c[3 + i], hn::Mul(a2, c[6 + i])));
    }
  }
  return j;
}

struct CollapseSums {
  V cost[kParts], square[kParts];
  std::uint64_t left = 0;
};

/// The patches of one batch's part.
template <bool kBrightness, bool kRays>
HWY_INLINE void collapse_part(const PhotometricInput& in, const Batches::Group& group,
                              std::size_t g, std::uint64_t b, int part, double* scratch,
                              const PhotometricOutput& out, CollapseSums& sums) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  const std::uint32_t* block = &batches.image[8 * b + lane];
  V c[16], d[3];
  load_cameras<2>(in.views, block, batches.uniform[b], c);
  const double* X = in.points + 24 * g + lane;
  const double* from = kRays ? in.rays + 24 * g + lane : X;
  for (int i = 0; i < 3; ++i) d[i] = load(from + 8 * i);
  const V s = kRays ? load(X) : set(1.0);
  const Place at = place_points(in.camera, c, d, s);
  double* seen = out.seen + 16 * b + lane;
  store(at.x, seen), store(at.y, seen + 8);
  alignas(64) double inside[8];
  const PatchLanes lanes{std::clamp(static_cast<int>(group.lanes) - lane, 0, kLanes),
                         &batches.lane_point[8 * g + lane], block, c[12], c[13]};
  V of[kPatchSums<kBrightness>];
  sums.left += kRays && in.warped
                   ? sum_warped_lanes<kBrightness>(in, lanes, at, seen, inside, scratch, of)
                   : sum_translated_lanes<kBrightness>(in, lanes, at, scratch, seen, inside, of);
  V cost = of[kCost];
  if (in.loss_per_patch) {
    const Rho rho = rho_lanes(LossLanes(in.loss), of[kSquare]);
    cost = rho.value;
    for (int k = kGxx; k < kPatchSums<kBrightness>; ++k) of[k] = hn::Mul(of[k], rho.weight);
  }
  const V fits = load(inside), mask = lane_mask(group.lanes, lane);
  const V away = hn::Mul(hn::Sub(set(1.0), fits), mask);
  const double* leaving = in.leaving + 16 * b + lane;
  cost = fma(cost, fits, hn::Mul(load(leaving), away));
  const V square = fma(of[kSquare], fits, hn::Mul(load(leaving + 8), away));
  double* costs = out.costs + 16 * b + lane;
  store(cost, costs), store(square, costs + 8);
  sums.cost[part] = hn::Add(sums.cost[part], cost);
  sums.square[part] = hn::Add(sums.square[part], square);
  const Whitened w = whiten<kBrightness>(of, out.brightness + kBrightnessBatch * b + lane);
  LaneJacobian j = rows_of<kRays>(w, in.camera, c, at, s);
  if (!hn::AllTrue(D(), hn::Gt(fits, zero()))) zero_rows(hn::Gt(fits, zero()), j);
  save(j, out.rows + kRowBatch * b + kJacobianFields * kLanes * part);
}

template <bool kBrightness, bool kRays>
void collapse_groups(const PhotometricInput& in, std::uint32_t first, std::uint32_t end,
                     PhotometricOutput& out) {
  Buffer<double> scratch;  // sums of warped patches; references of others
  const bool warped = kRays && in.warped;
  scratch.allocate(warped ? kSumScratch : kLanes * in.grid->cells());
  CollapseSums sums;
  for (int p = 0; p < kParts; ++p) sums.cost[p] = sums.square[p] = zero();
  for (std::uint32_t g = first; g < end; ++g) {
    const Batches::Group group = in.batches->groups[g];
    for (int p = 0; p < kParts; ++p) {
      if (!warped) spread_references(in, group, g, p, scratch.data());
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        collapse_part<kBrightness, kRays>(in, group, g, b, p, scratch.data(), out, sums);
    }
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

PhotometricKernels photometric_table(const char* name) { return {name, &collapse}; }

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const PhotometricKernels& photometric_kernels(const char* simd_name) {
  [[maybe_unused]] const std::string_view name = simd_name;
#if HWY_TARGETS & HWY_AVX3
  static const PhotometricKernels avx512 = N_AVX3::photometric_table("avx512");
  if (name == avx512.name) return avx512;
#endif
#if HWY_TARGETS & HWY_AVX2
  static const PhotometricKernels avx2 = N_AVX2::photometric_table("avx2");
  if (name == avx2.name) return avx2;
#endif
#if HWY_TARGETS & HWY_SSE4
  static const PhotometricKernels sse4 = N_SSE4::photometric_table("sse4");
  if (name == sse4.name) return sse4;
#endif
  static const PhotometricKernels baseline = HWY_STATIC_DISPATCH(photometric_table)("baseline");
  return baseline;
}

}  // namespace sheaf
#endif  // HWY_ONCE
