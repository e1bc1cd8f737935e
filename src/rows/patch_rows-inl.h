// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A patch's two rows: from its factors and where it is.
#if defined(SHEAF_RESIDUAL_PATCH_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_PATCH_ROWS_INL_H_
#undef SHEAF_RESIDUAL_PATCH_ROWS_INL_H_
#else
#define SHEAF_RESIDUAL_PATCH_ROWS_INL_H_
#endif

#include "lists/block_layout.h"
#include "rows/photometric.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The points of a part's lanes, as P = R d + s t takes them.
struct LanePoints {
  V d[3], s;
};

template <bool kRays>
HWY_INLINE LanePoints load_points(const PhotometricInput& in, std::size_t group, int lane) {
  const double* X = in.points + kPointGroup * group + lane;
  const double* from = kRays ? in.rays + kPointGroup * group + lane : X;
  return {{load(from), load(from + 8), load(from + 16)}, kRays ? load(X) : set(1.0)};
}

/// Where the lanes' points are: P in the camera's frame, and the patch's middle in the image.
struct Place {
  V P[3], iz, x, y;
};

HWY_INLINE Place place_points(const Pinhole& camera, const V* c, const V* d, V s) {
  Place at;
  for (int r = 0; r < 3; ++r)
    at.P[r] = fma(c[3 * r], d[0],
                  fma(c[3 * r + 1], d[1],
                      fma(c[3 * r + 2], d[2], hn::Mul(s, c[pose_record::kTranslation + r]))));
  at.iz = hn::Div(set(1.0), at.P[2]);
  at.x = fma(set(camera.fx), hn::Mul(at.P[0], at.iz), set(camera.cx));
  at.y = fma(set(camera.fy), hn::Mul(at.P[1], at.iz), set(camera.cy));
  return at;
}

HWY_INLINE void zero_rows(hn::Mask<D> keep, LaneJacobian& j) {
  for (int r = 0; r < 2; ++r) {
    j.r[r] = hn::IfThenElseZero(keep, j.r[r]);
    for (V& x : j.camera[r]) x = hn::IfThenElseZero(keep, x);
    for (V& x : j.point[r]) x = hn::IfThenElseZero(keep, x);
  }
}

/// The first two rows of the Cholesky factor of the Gram matrix of (gx, gy, -g, -1), and as much
/// of the residual: G = R^T R, R h = G^T r. A pivot that is rounding leaves a row of zeros.
struct Whitened {
  V r11, r12, r22, alpha[2], beta[2], h[2];
};

template <bool kBrightness>
HWY_INLINE void save_factors(const Whitened& w, double* to) {
  store(w.r11, to), store(w.r12, to + 8), store(w.r22, to + 16);
  for (int r = 0; r < 2; ++r) {
    store(w.h[r], to + 24 + 8 * r);
    if constexpr (kBrightness)
      store(w.alpha[r], to + 40 + 8 * r), store(w.beta[r], to + 56 + 8 * r);
  }
}

template <bool kBrightness>
HWY_INLINE Whitened restore_factors(const double* from) {
  Whitened w;
  w.r11 = load(from), w.r12 = load(from + 8), w.r22 = load(from + 16);
  for (int r = 0; r < 2; ++r) {
    w.h[r] = load(from + 24 + 8 * r);
    w.alpha[r] = kBrightness ? load(from + 40 + 8 * r) : zero();
    w.beta[r] = kBrightness ? load(from + 56 + 8 * r) : zero();
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
      const V* t = c + pose_record::kTranslation;
      j.point[r][0] = fma(a0, t[0], fma(a1, t[1], hn::Mul(a2, t[2])));
      j.point[r][1] = j.point[r][2] = zero();
    } else {
      for (int i = 0; i < 3; ++i)
        j.point[r][i] = fma(a0, c[i], fma(a1, c[3 + i], hn::Mul(a2, c[6 + i])));
    }
  }
  return j;
}

/// The rows of a part of batch b, of points X, as collapse would have stored them.
template <bool kBrightness, bool kRays>
HWY_INLINE LaneJacobian rows_again(const PhotometricInput& in, const double* factors,
                                   std::uint64_t b, int lane, const LanePoints& X) {
  V c[8 * view_record::kOctets];
  load_state<view_record::kOctets, kViewRecord>(in.views, &in.batches->image[8 * b + lane],
                                                in.batches->uniform[b], c);
  const Place at = place_points(in.camera, c, X.d, X.s);
  const Whitened w = restore_factors<kBrightness>(factors + patch_factors(kBrightness) * b + lane);
  LaneJacobian j = rows_of<kRays>(w, in.camera, c, at, X.s);
  // Patches that left have no factors, and may be where nothing is finite.
  const auto counts = hn::Ne(hn::Add(w.r11, w.r22), zero());
  if (!hn::AllTrue(D(), counts)) zero_rows(counts, j);
  return j;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
