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
  double P[3], along[3], down[3];  ///< of a warped patch: its middle, and a pixel right and down
};

HWY_INLINE V load_greys(const float* p) {
  const hn::Rebind<float, D> d;
  return hn::PromoteTo(D(), hn::LoadU(d, p));
}

/// Of a narrow grid's eight lanes the upper four stand `jump` floats further than the lower. A part
/// of four lanes or fewer begins where it stands.
template <bool kNarrow>
HWY_INLINE V load_row(const float* p, [[maybe_unused]] std::ptrdiff_t jump) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kNarrow && kLanes == 8) {
    const hn::Rebind<float, D> d;
    const hn::Half<hn::Rebind<float, D>> half;
    return hn::PromoteTo(D(), hn::Combine(d, hn::LoadU(half, p + jump), hn::LoadU(half, p)));
  }
#endif
  return load_greys(p);
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
  template <bool kNarrow>
  HWY_INLINE void read(const float* p, std::ptrdiff_t jump, const LaneTaps& x) {
    const V a = load_row<kNarrow>(p, jump), b = load_row<kNarrow>(p + 1, jump);
    const V c = load_row<kNarrow>(p + 2, jump), d = load_row<kNarrow>(p + 3, jump);
    value = fma(x.value[0], a, fma(x.value[1], b, fma(x.value[2], c, hn::Mul(x.value[3], d))));
    slope = fma(x.slope[0], a, fma(x.slope[1], b, fma(x.slope[2], c, hn::Mul(x.slope[3], d))));
  }
};

HWY_INLINE V across(const V* weights, V a, V b, V c, V d) {
  return fma(weights[0], a, fma(weights[1], b, fma(weights[2], c, hn::Mul(weights[3], d))));
}

/// One image read at a part's pixels, and what they stand for.
struct LanePixels {
  V mask, reference, grey, gx, gy;
};

template <bool kBrightness>
HWY_INLINE void add_pixels(const LanePixels& at, V alpha, V beta, const LossLanes& loss, bool weigh,
                           V* sums) {
  const V g = at.reference, gx = at.gx, gy = at.gy;
  const V r = hn::Mul(at.mask, hn::Sub(at.grey, fma(alpha, g, beta)));
  const V square = hn::Mul(r, r);
  V w = at.mask, rho = square;
  if (weigh) {
    const Rho of = rho_lanes(loss, square);
    w = hn::Mul(w, of.weight), rho = of.value;
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
}

/// Where the rows of a strip's part lie: they all have the same fraction of a pixel.
struct Strip {
  const float* corner;  ///< one pixel left of and above the first
  std::ptrdiff_t stride, jump;
  const float *reference, *mask;
  int steps;
};

/// Eight columns of a part, from a strip's top row down.
template <bool kBrightness, bool kNarrow>
HWY_INLINE void sum_strip(const Strip& strip, const LaneTaps& x, const LaneTaps& y, V alpha, V beta,
                          const LossLanes& loss, bool weigh, V* sums) {
  RowTaps r0, r1, r2, r3;
  r0.read<kNarrow>(strip.corner, strip.jump, x);
  r1.read<kNarrow>(strip.corner + strip.stride, strip.jump, x);
  r2.read<kNarrow>(strip.corner + 2 * strip.stride, strip.jump, x);
  for (int row = 0; row < strip.steps; ++row) {
    r3.read<kNarrow>(strip.corner + (row + 3) * strip.stride, strip.jump, x);
    const LanePixels at{load_greys(strip.mask + 8 * row), load_greys(strip.reference + 8 * row),
                        across(y.value, r0.value, r1.value, r2.value, r3.value),
                        across(y.value, r0.slope, r1.slope, r2.slope, r3.slope),
                        across(y.slope, r0.value, r1.value, r2.value, r3.value)};
    add_pixels<kBrightness>(at, alpha, beta, loss, weigh, sums);
    r0 = r1, r1 = r2, r2 = r3;
  }
}

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

/// Lanes of doubles that are whole numbers, as indices of floats.
using GreyTag = hn::Rebind<float, D>;
using IndexTag = hn::Rebind<std::int32_t, D>;

/// The plane at (x, y) of each lane; positions outside are moved to the border.
HWY_INLINE void read_spread(const GreyPlane& plane, Taps taps, V x, V y, LanePixels& at) {
  const V left = set(-2.0), right = set(plane.width() + 1.0), bottom = set(plane.height() + 1.0);
  x = hn::Min(hn::Max(x, left), right);
  y = hn::Min(hn::Max(y, left), bottom);
  const V x0 = hn::Floor(x), y0 = hn::Floor(y);
  const SpreadTaps wx(taps, hn::Sub(x, x0)), wy(taps, hn::Sub(y, y0));
  const V place = fma(y0, set(static_cast<double>(plane.stride())), x0);
  const auto index = hn::DemoteTo(IndexTag(), place);
  at.grey = at.gx = at.gy = zero();
  for (int r = 0; r < 4; ++r) {
    const float* row = plane.at(-1, r - 1);
    V greys[4];
    for (int c = 0; c < 4; ++c)
      greys[c] = hn::PromoteTo(D(), hn::GatherIndex(GreyTag(), row + c, index));
    const V value = across(wx.value, greys[0], greys[1], greys[2], greys[3]);
    const V slope = across(wx.slope, greys[0], greys[1], greys[2], greys[3]);
    at.grey = fma(wy.value[r], value, at.grey);
    at.gx = fma(wy.value[r], slope, at.gx);
    at.gy = fma(wy.slope[r], value, at.gy);
  }
}

/// The patch with each pixel projected by itself: P of pixel (dx, dy) is P + dx along + dy down.
template <bool kBrightness>
HWY_INLINE void sum_warped(const PhotometricInput& in, const PatchAt& patch, const LossLanes& loss,
                           bool weigh, double* to) {
  const PatchGrid& grid = *in.grid;
  const V alpha = set(patch.alpha), beta = set(patch.beta);
  for (int p = 0; p < kParts; ++p) {
    V sums[kPatchSums<kBrightness>];
    for (V& s : sums) s = zero();
    for (int step = 0; step < grid.strips * grid.steps; ++step) {
      const int cells = 8 * step + p * kLanes;
      const V dx = load_greys(grid.dx.data() + cells), dy = load_greys(grid.dy.data() + cells);
      V P[3];
      for (int i = 0; i < 3; ++i)
        P[i] = fma(dx, set(patch.along[i]), fma(dy, set(patch.down[i]), set(patch.P[i])));
      const V iz = hn::Div(set(1.0), P[2]);
      LanePixels at;
      at.mask = load_greys(grid.mask.data() + cells);
      at.reference = load_greys(patch.reference + cells);
      read_spread(*patch.plane, in.taps,
                  fma(set(in.camera.fx), hn::Mul(P[0], iz), set(in.camera.cx)),
                  fma(set(in.camera.fy), hn::Mul(P[1], iz), set(in.camera.cy)), at);
      add_pixels<kBrightness>(at, alpha, beta, loss, weigh, sums);
    }
    for (int k = 0; k < kPatchSums<kBrightness>; ++k)
      store(sums[k], to + kSumStride * k + p * kLanes);
  }
}

/// The sums of one patch that fits, eight lanes of each: sum k to `to` + kSumStride k.
template <bool kBrightness>
HWY_INLINE void sum_patch(const PhotometricInput& in, const PatchAt& at, double* to) {
  const LossLanes loss(in.loss);
  const bool weigh = !in.loss_per_patch && loss.kind != LossKind::none;
  if (in.warped) return sum_warped<kBrightness>(in, at, loss, weigh, to);
  const PatchGrid& grid = *in.grid;
  const double x0 = std::floor(at.x), y0 = std::floor(at.y);
  const LaneTaps x(tap_weights(in.taps, at.x - x0)), y(tap_weights(in.taps, at.y - y0));
  const float* corner =
      at.plane->at(static_cast<int>(x0) + grid.left - 1, static_cast<int>(y0) + grid.top - 1);
  const V alpha = set(at.alpha), beta = set(at.beta);
  for (int p = 0; p < kParts; ++p) {
    V sums[kPatchSums<kBrightness>];
    for (V& s : sums) s = zero();
    const std::ptrdiff_t stride = at.plane->stride(), jump = grid.steps * stride;
    for (int k = 0; k < grid.strips; ++k) {
      const int lane = p * kLanes, cells = 8 * grid.steps * k + lane;
      const float* first = corner + (grid.narrow ? lane % 4 + lane / 4 * jump : 8 * k + lane);
      const Strip strip{first,     stride, jump, at.reference + cells, grid.mask.data() + cells,
                        grid.steps};
      if (grid.narrow)
        sum_strip<kBrightness, true>(strip, x, y, alpha, beta, loss, weigh, sums);
      else
        sum_strip<kBrightness, false>(strip, x, y, alpha, beta, loss, weigh, sums);
    }
    for (int k = 0; k < kPatchSums<kBrightness>; ++k)
      store(sums[k], to + kSumStride * k + p * kLanes);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
