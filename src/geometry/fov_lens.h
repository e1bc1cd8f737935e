// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_FOV_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_FOV_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// u = (fx, fy) g e + c with g = atan2(a r, z) / omega, a = 2 tan(omega / 2), r = |P.xy|,
/// e = P.xy / r: one parameter for a lens that compresses its border. Valid in all directions but
/// exactly backwards; as omega -> 0 the perspective camera, by the series in omega below 1e-4
/// (exact to 1e-15 while r < 5 z).
struct FovLens {
  static constexpr int kColmapId = 7;
  static constexpr std::string_view kName = "FOV";
  static constexpr std::array<std::string_view, 5> kParameters{"fx", "fy", "cx", "cy", "omega"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    using std::atan2;
    using std::sqrt;
    using std::tan;
    const T small(1e-4);
    const auto is_small = k[4] * k[4] < small * small;
    const T omega = select(is_small, small, k[4]);
    const T half = tan(omega / T(2)), a = half + half;
    const T square = P[0] * P[0] + P[1] * P[1] + T(kTinySquare);
    const T r = sqrt(square);
    const T s = atan2(a * r, P[2]) / (omega * r);
    // With q = a / (omega (z^2 + a^2 r^2)): dg/dr = z q, dg/dz = -r q.
    const T q = a / (omega * (P[2] * P[2] + a * a * square));
    const T ex = P[0] / r, ey = P[1] / r;
    const T along = P[2] * q - s;
    OnPlane<T> m{s * P[0],
                 s * P[1],
                 {{{s + along * ex * ex, along * ex * ey, -P[0] * q},
                   {along * ex * ey, s + along * ey * ey, -P[1] * q}}}};
    // da/domega = 1 + tan^2(omega / 2) and d g / d a = z r / (omega (z^2 + a^2 r^2)).
    const T by_omega = (T(1) + half * half) * P[2] * q / a - s / omega;
    T dx = by_omega * P[0], dy = by_omega * P[1];
    straighten(k[4], P, is_small, m, dx, dy);
    to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
    by_parameter<2>(k, 4, dx, dy, out);
  }
  static bool sees(const double* k, const double* P) {
    return P[2] > 0 || (k[4] * k[4] >= 1e-8 && (P[0] != 0 || P[1] != 0));
  }

 private:
  /// Where omega is small: m (1 + omega^2 (1/12 - n / 3)) of the perspective m, n = |m|^2.
  template <class T, class Mask>
  static void straighten(const T& omega, const T* P, const Mask& is_small, OnPlane<T>& m, T& dx,
                         T& dy) {
    const OnPlane<T> p = perspective(P);
    const T n = p.x * p.x + p.y * p.y, w = omega * omega;
    const T bracket = T(1.0 / 12) - n / T(3);
    const Distorted<T> d = radial_distortion(p, T(1) + w * bracket, -w / T(3));
    m.x = select(is_small, d.x, m.x);
    m.y = select(is_small, d.y, m.y);
    for (int j = 0; j < 3; ++j) {
      m.d[0][j] = select(is_small, d.xx * p.d[0][j] + d.xy * p.d[1][j], m.d[0][j]);
      m.d[1][j] = select(is_small, d.yx * p.d[0][j] + d.yy * p.d[1][j], m.d[1][j]);
    }
    const T slope = T(2) * omega * bracket;
    dx = select(is_small, slope * p.x, dx);
    dy = select(is_small, slope * p.y, dy);
  }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_FOV_LENS_H_
