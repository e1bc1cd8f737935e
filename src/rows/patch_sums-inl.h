// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What the pixels of patches collapse to: interpolation by separable taps, and sums over a patch.
#if defined(SHEAF_RESIDUAL_PATCH_SUMS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#undef SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#else
#define SHEAF_RESIDUAL_PATCH_SUMS_INL_H_
#endif

#include "rows/metric_lanes-inl.h"
#include "rows/patch_rows-inl.h"
#include "rows/photometric.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Sums over a patch's pixels: of rho and, not weighted, of r^2; then products of the slopes gx,
/// gy, the residual r, the reference's grey g and one. Those with r are weighted by rho', which
/// makes the gradient that of the loss; the others by rho' phi, its curvature
/// (geometry/row_metric.h: a pixel has one row, along its residual). Those from kGxg on are for the
/// brightness.
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

using GreyTag = hn::Rebind<float, D>;
using Greys = hn::Vec<GreyTag>;
/// Lanes of doubles that are whole numbers, as indices of greys.
using IndexTag = hn::Rebind<std::int32_t, D>;

HWY_INLINE V load_greys(const float* p) { return hn::PromoteTo(D(), hn::LoadU(GreyTag(), p)); }

/// The points of a part's lanes, and the camera blocks that see them.
struct PatchLanes {
  int used;  ///< lanes that have a point
  V mask;    ///< 1 where they have one
  const std::uint32_t *point, *block;
  bool uniform;  ///< one block for all
  V alpha, beta;
};

/// Weights of four taps, each lane with a fraction of its own; tap_weights is the scalar twin.
struct SpreadTaps {
  V value[4], slope[4];
  HWY_INLINE SpreadTaps(Taps taps, V f) {
    const V one = set(1.0), half = set(0.5), left = hn::Sub(one, f);
    if (taps != Taps::catmull_rom) {
      value[0] = value[3] = zero(), value[1] = left, value[2] = f;
      const bool central = taps == Taps::bilinear_central;
      slope[0] = central ? hn::Neg(hn::Mul(half, left)) : zero();
      slope[1] = central ? hn::Neg(hn::Mul(half, f)) : set(-1.0);
      slope[2] = central ? hn::Mul(half, left) : one;
      slope[3] = central ? hn::Mul(half, f) : zero();
      return;
    }
    const V f2 = hn::Mul(f, f);
    value[0] = hn::Mul(f, fms(f, fnma(half, f, one), half));
    value[1] = fma(f2, fms(set(1.5), f, set(2.5)), one);
    value[2] = hn::Mul(f, fma(f, fnma(set(1.5), f, set(2.0)), half));
    value[3] = hn::Mul(hn::Mul(f2, half), hn::Sub(f, one));
    slope[0] = fms(f, fnma(set(1.5), f, set(2.0)), half);
    slope[1] = hn::Mul(f, fms(set(4.5), f, set(5.0)));
    slope[2] = fma(f, fnma(set(4.5), f, set(4.0)), half);
    slope[3] = hn::Mul(f, fms(set(1.5), f, one));
  }
};

HWY_INLINE V across(const V* weights, V a, V b, V c, V d) {
  return fma(weights[0], a, fma(weights[1], b, fma(weights[2], c, hn::Mul(weights[3], d))));
}

/// What is common to the pixels that are summed.
struct Look {
  V alpha, beta;
  LossLanes loss;
  bool weigh;  ///< the loss is on pixels
  HWY_INLINE Look(const PhotometricInput& in, V a, V b)
      : alpha(a),
        beta(b),
        loss(in.loss),
        weigh(!in.loss_per_patch && in.loss.kind != LossKind::none) {}
};

/// An image read between its pixels, and the reference.
struct LanePixels {
  V reference, grey, gx, gy;
};

/// One pixel for each lane; `mask` is 1 where there is one and 0 elsewhere. kWeigh: look.weigh may
/// be; without it sums[kCost], which is sums[kSquare], is not summed.
template <bool kBrightness, bool kMasked, bool kWeigh = true>
HWY_INLINE void add_pixels(const LanePixels& at, const Look& look, [[maybe_unused]] V mask,
                           V* sums) {
  const V g = at.reference, gx = at.gx, gy = at.gy;
  V r = hn::Sub(at.grey, fma(look.alpha, g, look.beta)), wx = gx, wy = gy;
  if constexpr (kMasked) r = hn::Mul(mask, r), wx = hn::Mul(mask, gx), wy = hn::Mul(mask, gy);
  const V square = hn::Mul(r, r), x = wx, y = wy;
  V w = kMasked ? mask : set(1.0);
  if constexpr (kWeigh) {
    V rho = square;
    if (look.weigh) {
      const Rho of = rho_lanes(look.loss, square);
      r = hn::Mul(of.weight, r), rho = of.value;
      w = hn::Mul(hn::Mul(w, of.weight), of.along);
      wx = hn::Mul(w, gx), wy = hn::Mul(w, gy);
    }
    sums[kCost] = hn::Add(rho, sums[kCost]);
  }
  sums[kGxx] = fma(wx, gx, sums[kGxx]);
  sums[kGxy] = fma(wx, gy, sums[kGxy]);
  sums[kGyy] = fma(wy, gy, sums[kGyy]);
  sums[kGxr] = fma(x, r, sums[kGxr]);
  sums[kGyr] = fma(y, r, sums[kGyr]);
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
    sums[kGr] = fma(g, r, sums[kGr]);
    sums[k1r] = hn::Add(r, sums[k1r]);
  }
}

/// A loss on a patch as one vector: with J^T r = b, its J^T M J = w (J^T J - (1 - phi) / s b b^T).
template <bool kBrightness>
HWY_INLINE V apply_patch_loss(const ScaledLoss& loss, V* sums) {
  const V s = sums[kSquare];
  const Rho rho = rho_lanes(LossLanes(loss), s);
  const V less = over_square(hn::Sub(set(1.0), rho.along), s);
  const V x = hn::Mul(less, sums[kGxr]), y = hn::Mul(less, sums[kGyr]);
  const auto take = [sums](int at, V a, int b) { sums[at] = fnma(a, sums[b], sums[at]); };
  take(kGxx, x, kGxr), take(kGxy, x, kGyr), take(kGyy, y, kGyr);
  if constexpr (kBrightness) {
    const V g = hn::Mul(less, sums[kGr]), one = hn::Mul(less, sums[k1r]);
    take(kGxg, x, kGr), take(kGyg, y, kGr), take(kGx1, x, k1r), take(kGy1, y, k1r);
    take(kGg, g, kGr), take(kG1, g, k1r), take(k11, one, k1r);
  }
  for (int k = kGxx; k < kPatchSums<kBrightness>; ++k) sums[k] = hn::Mul(sums[k], rho.weight);
  return rho.value;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
