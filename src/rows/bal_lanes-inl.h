// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The BAL camera on lanes; geometry/bal_camera.h is the scalar statement of the same formulas.
#if defined(SHEAF_RESIDUAL_BAL_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_BAL_LANES_INL_H_
#undef SHEAF_RESIDUAL_BAL_LANES_INL_H_
#else
#define SHEAF_RESIDUAL_BAL_LANES_INL_H_
#endif

#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A point in the camera's frame and its normalised image p = -P.xy / P.z; W: lanes of double or
/// of float.
template <class W>
struct SeenAs {
  W P0, P1, P2, iz, x, y, n;
};
using Seen = SeenAs<V>;

/// c: the fields of the camera records by number, an array of W or what reads one.
template <class C, class W>
HWY_INLINE SeenAs<W> see(const C& c, W X0, W X1, W X2) {
  SeenAs<W> s;
  s.P0 = fma(c[0], X0, fma(c[1], X1, fma(c[2], X2, c[camera_record::kTranslation])));
  s.P1 = fma(c[3], X0, fma(c[4], X1, fma(c[5], X2, c[camera_record::kTranslation + 1])));
  s.P2 = fma(c[6], X0, fma(c[7], X1, fma(c[8], X2, c[camera_record::kTranslation + 2])));
  s.iz = hn::Div(fill<W>(-1.0), s.P2);
  s.x = hn::Mul(s.P0, s.iz);
  s.y = hn::Mul(s.P1, s.iz);
  s.n = fma(s.x, s.x, hn::Mul(s.y, s.y));
  return s;
}

/// d = 1 + k1 n + k2 n^2.
template <class C, class W>
HWY_INLINE W distortion(const C& c, W n) {
  return fma(n, fma(n, c[camera_record::kK2], c[camera_record::kK1]), fill<W>(1.0));
}

/// dd = f (2 k1 + 4 k2 n).
template <class C, class W>
HWY_INLINE W distortion_slope(const C& c, W n) {
  const W k1 = hn::Add(c[camera_record::kK1], c[camera_record::kK1]);
  const W k2 = hn::Mul(fill<W>(4.0), c[camera_record::kK2]);
  return hn::Mul(c[camera_record::kFocal], fma(k2, n, k1));
}

/// scale multiplies residual and Jacobian (0 for masked lanes); nullptr: all ones.
HWY_INLINE LaneJacobian linearize_lanes(const V* c, V X0, V X1, V X2, V zx, V zy, const V* scale) {
  const Seen s = see(c, X0, X1, X2);
  V d = distortion(c, s.n);
  V f = c[camera_record::kFocal];
  V fd = hn::Mul(f, d);
  const V dd = distortion_slope(c, s.n);
  const V ddx = hn::Mul(dd, s.x);
  LaneJacobian j;
  j.r[0] = fms(fd, s.x, zx);
  j.r[1] = fms(fd, s.y, zy);
  // A = (fd I + dd p p^T) iz [I | p] = [a b a2; b e e2].
  V a = hn::Mul(fma(ddx, s.x, fd), s.iz);
  V b = hn::Mul(hn::Mul(ddx, s.y), s.iz);
  V e = hn::Mul(fma(hn::Mul(dd, s.y), s.y, fd), s.iz);
  if (scale != nullptr) {
    const V m = *scale;
    j.r[0] = hn::Mul(j.r[0], m), j.r[1] = hn::Mul(j.r[1], m);
    a = hn::Mul(a, m), b = hn::Mul(b, m), e = hn::Mul(e, m), d = hn::Mul(d, m), f = hn::Mul(f, m);
  }
  const V a2 = fma(a, s.x, hn::Mul(b, s.y));
  const V e2 = fma(b, s.x, hn::Mul(e, s.y));
  const V fn = hn::Mul(f, s.n);
  const V fnn = hn::Mul(fn, s.n);
  j.camera[0][0] = a, j.camera[0][1] = b, j.camera[0][2] = a2;
  j.camera[1][0] = b, j.camera[1][1] = e, j.camera[1][2] = e2;
  j.camera[0][3] = fms(a2, s.P1, hn::Mul(b, s.P2));
  j.camera[0][4] = fms(a, s.P2, hn::Mul(a2, s.P0));
  j.camera[0][5] = fms(b, s.P0, hn::Mul(a, s.P1));
  j.camera[1][3] = fms(e2, s.P1, hn::Mul(e, s.P2));
  j.camera[1][4] = fms(b, s.P2, hn::Mul(e2, s.P0));
  j.camera[1][5] = fms(e, s.P0, hn::Mul(b, s.P1));
  j.camera[0][6] = hn::Mul(d, s.x), j.camera[1][6] = hn::Mul(d, s.y);
  j.camera[0][7] = hn::Mul(fn, s.x), j.camera[1][7] = hn::Mul(fn, s.y);
  j.camera[0][8] = hn::Mul(fnn, s.x), j.camera[1][8] = hn::Mul(fnn, s.y);
  for (int i = 0; i < 3; ++i) {
    j.point[0][i] = fma(a, c[i], fma(b, c[3 + i], hn::Mul(a2, c[6 + i])));
    j.point[1][i] = fma(b, c[i], fma(e, c[3 + i], hn::Mul(e2, c[6 + i])));
  }
  return j;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
