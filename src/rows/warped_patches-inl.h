// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Patches whose pixels are projected one by one: a patch at a time, its pixels in the lanes.
#if defined(SHEAF_RESIDUAL_WARPED_PATCHES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_WARPED_PATCHES_INL_H_
#undef SHEAF_RESIDUAL_WARPED_PATCHES_INL_H_
#else
#define SHEAF_RESIDUAL_WARPED_PATCHES_INL_H_
#endif

#include <limits>

#include "rows/patch_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Scratch: of each sum, eight lanes for each of kLanes patches.
constexpr int kSumStride = 64, kSumScratch = kSumStride * kPatchSums<true>;

struct PatchAt {
  const GreyPlane* plane;
  double alpha, beta;
  const float* reference;
  double P[3], along[3], down[3];  ///< its middle, and a pixel right and down
};

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
HWY_INLINE void sum_warped(const PhotometricInput& in, const PatchAt& patch, double* to) {
  const PatchGrid& grid = *in.grid;
  const Look look(in, set(patch.alpha), set(patch.beta));
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
      at.reference = load_greys(patch.reference + cells);
      read_spread(*patch.plane, in.taps,
                  fma(set(in.camera.fx), hn::Mul(P[0], iz), set(in.camera.cx)),
                  fma(set(in.camera.fy), hn::Mul(P[1], iz), set(in.camera.cy)), at);
      add_pixels<kBrightness, true>(at, look, load_greys(grid.mask.data() + cells), sums);
    }
    for (int k = 0; k < kPatchSums<kBrightness>; ++k)
      store(sums[k], to + kSumStride * k + p * kLanes);
  }
}

/// Where the pixels of one lane's patch go; false where a corner of it leaves the image.
HWY_INLINE bool warp_patch(const PhotometricInput& in, std::uint32_t block, const double* P,
                           PatchAt& patch) {
  const double* R = in.views + kViewRecord * block;
  const PatchGrid& grid = *in.grid;
  for (int i = 0; i < 3; ++i) {
    patch.P[i] = P[i];
    patch.along[i] = R[3 * i] / in.camera.fx;
    patch.down[i] = R[3 * i + 1] / in.camera.fy;
  }
  for (int dx : {grid.left, grid.right()})
    for (int dy : {grid.top, grid.bottom()}) {
      double Q[3];
      for (int i = 0; i < 3; ++i) Q[i] = P[i] + dx * patch.along[i] + dy * patch.down[i];
      const Pinhole& k = in.camera;
      if (!(Q[2] > 0) ||
          !pixel_fits(*patch.plane, k.fx * (Q[0] / Q[2]) + k.cx, k.fy * (Q[1] / Q[2]) + k.cy))
        return false;
    }
  return true;
}

/// The sums of a part's patches; 1 in `inside` for those that fit, and no place in `seen` for the
/// others. Returns how many of these there are.
template <bool kBrightness>
HWY_INLINE std::uint64_t sum_warped_lanes(const PhotometricInput& in, const PatchLanes& lanes,
                                          const Place& at, double* seen, double* inside,
                                          double* scratch, V* sums) {
  std::uint64_t left = 0;
  alignas(64) double P[3][8], alpha[8], beta[8];
  for (int i = 0; i < 3; ++i) store(at.P[i], P[i]);
  store(lanes.alpha, alpha), store(lanes.beta, beta);
  for (int l = 0; l < kLanes; ++l) {
    double* to = scratch + 8 * l;
    PatchAt patch{
        &in.planes[in.block_image[lanes.block[l]]], alpha[l], beta[l], nullptr, {}, {}, {}};
    const double middle[3] = {P[0][l], P[1][l], P[2][l]};
    const bool used = l < lanes.used;
    const bool fits = used && P[2][l] > 0 &&
                      patch_fits(*in.grid, *patch.plane, seen[l], seen[8 + l]) &&
                      warp_patch(in, lanes.block[l], middle, patch);
    inside[l] = fits ? 1 : 0;
    if (fits) {
      patch.reference = in.references + in.grid->cells() * lanes.point[l];
      sum_warped<kBrightness>(in, patch, to);
    } else {
      for (int k = 0; k < kPatchSums<kBrightness>; ++k) store_zeros(to + kSumStride * k);
      seen[l] = seen[8 + l] = std::numeric_limits<double>::quiet_NaN();
      left += used;
    }
  }
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = add_lanes(scratch + kSumStride * k);
  return left;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
