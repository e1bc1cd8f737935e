// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// One patch against one image: interpolation by separable taps and the sums that its pixels
// collapse to. Eight lanes are eight columns of the patch's grid.
#if defined(SHEAF_RESIDUAL_PATCH_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#undef SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#else
#define SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#endif

#include <cmath>

#include "residual/loss_lanes-inl.h"
#include "residual/photometric.h"
#include "residual/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Sums over a patch's pixels: of rho and, not weighted, of r^2; then, weighted by the loss,
/// products of the slopes gx, gy, the residual r, the reference's grey g and one. Those from kGxg
/// on are for the brightness.
enum PatchSum {
  kCost,
  kSquare,
  kGxx,
  kGxy,
  kGyy,
  kGxr,
  kGyr,
  kGxg,
  kGyg,
  kGx1,
  kGy1,
  kGg,
  kG1,
  k11,
  kGr,
  k1r,
};
template <bool kBrightness>
constexpr int kPatchSums = kBrightness ? k1r + 1 : kGxg;
/// Scratch: of each sum, eight lanes for each of kLanes patches.
constexpr int kSumStride = 64, kSumScratch = kSumStride * kPatchSums<true>;

struct PatchAt {
  const GreyPlane* plane;
  double x, y;  ///< of its middle
  double alpha, beta;
  const float* reference;
};

HWY_INLINE V load_greys(const float* p) {
  const hn::Rebind<float, D> d;
  return hn::PromoteTo(D(), hn::LoadU(d, p));
}

HWY_INLINE void store_zeros(double* to) {
  for (int p = 0; p < kParts; ++p) store(zero(), to + p * kLanes);
}

/// Eight lanes of each of kLanes patches, added in sum8's order: one patch a lane.
HWY_INLINE V add_lanes(const double* of) {
  constexpr std::uint32_t kOrder[8] = {0, 1, 2, 3, 4, 5, 6, 7};
  V f[8];
  load_records(of, 8, kOrder, f);
  return hn::Add(hn::Add(hn::Add(f[0], f[1]), hn::Add(f[2], f[3])),
                 hn::Add(hn::Add(f[4], f[5]), hn::Add(f[6], f[7])));
}

HWY_INLINE void zero_rows(hn::Mask<D> keep, LaneJacobian& j) {
  for (int r = 0; r < 2; ++r) {
    j.r[r] = hn::IfThenElseZero(keep, j.r[r]);
    for (V& x : j.camera[r]) x = hn::IfThenElseZero(keep, x);
    for (V& x : j.point[r]) x = hn::IfThenElseZero(keep, x);
  }
}

/// Taps in registers.
struct LaneTaps {
  V value[4], slope[4];
  HWY_INLINE explicit LaneTaps(const TapWeights& w) {
    for (int k = 0; k < 4; ++k) value[k] = set(w.value[k]), slope[k] = set(w.slope[k]);
  }
};

/// A row of the image under the patch, interpolated along x: value and slope.
struct RowTaps {
  V value, slope;
  HWY_INLINE void read(const float* p, const LaneTaps& x) {
    const V a = load_greys(p), b = load_greys(p + 1), c = load_greys(p + 2), d = load_greys(p + 3);
    value = fma(x.value[0], a, fma(x.value[1], b, fma(x.value[2], c, hn::Mul(x.value[3], d))));
    slope = fma(x.slope[0], a, fma(x.slope[1], b, fma(x.slope[2], c, hn::Mul(x.slope[3], d))));
  }
};

HWY_INLINE V across(const V* weights, V a, V b, V c, V d) {
  return fma(weights[0], a, fma(weights[1], b, fma(weights[2], c, hn::Mul(weights[3], d))));
}

/// Eight columns of a part, from a strip's top row down.
template <bool kBrightness>
HWY_INLINE void sum_strip(const PhotometricInput& in, const float* corner, std::ptrdiff_t stride,
                          const LaneTaps& x, const LaneTaps& y, V alpha, V beta,
                          const float* reference, const float* mask, const LossLanes& loss,
                          V* sums) {
  RowTaps r0, r1, r2, r3;
  r0.read(corner, x);
  r1.read(corner + stride, x);
  r2.read(corner + 2 * stride, x);
  const bool weigh = !in.loss_per_patch && loss.kind != LossKind::none;
  for (int row = 0; row < in.grid->rows; ++row) {
    r3.read(corner + (row + 3) * stride, x);
    const V m = load_greys(mask + 8 * row), g = load_greys(reference + 8 * row);
    const V I = across(y.value, r0.value, r1.value, r2.value, r3.value);
    const V gx = across(y.value, r0.slope, r1.slope, r2.slope, r3.slope);
    const V gy = across(y.slope, r0.value, r1.value, r2.value, r3.value);
    const V r = hn::Mul(m, hn::Sub(I, fma(alpha, g, beta)));
    const V square = hn::Mul(r, r);
    V w = m, rho = square;
    if (weigh) {
      const Rho of = rho_lanes(loss, square);
      w = hn::Mul(m, of.weight), rho = of.value;
    }
    const V wx = hn::Mul(w, gx), wy = hn::Mul(w, gy);
    sums[kGxx] = fma(wx, gx, sums[kGxx]);
    sums[kGxy] = fma(wx, gy, sums[kGxy]);
    sums[kGyy] = fma(wy, gy, sums[kGyy]);
    sums[kGxr] = fma(wx, r, sums[kGxr]);
    sums[kGyr] = fma(wy, r, sums[kGyr]);
    sums[kCost] = hn::Add(rho, sums[kCost]);
    sums[kSquare] = hn::Add(square, sums[kSquare]);
    if constexpr (kBrightness) {
      const V wg = hn::Mul(w, g);
      sums[kGxg] = fma(wx, g, sums[kGxg]);
      sums[kGyg] = fma(wy, g, sums[kGyg]);
      sums[kGx1] = hn::Add(wx, sums[kGx1]);
      sums[kGy1] = hn::Add(wy, sums[kGy1]);
      sums[kGg] = fma(wg, g, sums[kGg]);
      sums[kG1] = hn::Add(wg, sums[kG1]);
      sums[k11] = hn::Add(w, sums[k11]);
      sums[kGr] = fma(wg, r, sums[kGr]);
      sums[k1r] = fma(w, r, sums[k1r]);
    }
    r0 = r1, r1 = r2, r2 = r3;
  }
}

/// The sums of one patch that fits, eight lanes of each: sum k to `to` + kSumStride k.
template <bool kBrightness>
HWY_INLINE void sum_patch(const PhotometricInput& in, const PatchAt& at, double* to) {
  const PatchGrid& grid = *in.grid;
  const double x0 = std::floor(at.x), y0 = std::floor(at.y);
  const LaneTaps x(tap_weights(in.taps, at.x - x0)), y(tap_weights(in.taps, at.y - y0));
  const float* corner =
      at.plane->at(static_cast<int>(x0) + grid.left - 1, static_cast<int>(y0) + grid.top - 1);
  const LossLanes loss(in.loss);
  const V alpha = set(at.alpha), beta = set(at.beta);
  for (int p = 0; p < kParts; ++p) {
    V sums[kPatchSums<kBrightness>];
    for (V& s : sums) s = zero();
    for (int strip = 0; strip < grid.strips; ++strip) {
      const int cells = 8 * grid.rows * strip + p * kLanes;
      sum_strip<kBrightness>(in, corner + 8 * strip + p * kLanes, at.plane->stride(), x, y, alpha,
                             beta, at.reference + cells, grid.mask.data() + cells, loss, sums);
    }
    for (int k = 0; k < kPatchSums<kBrightness>; ++k)
      store(sums[k], to + kSumStride * k + p * kLanes);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
