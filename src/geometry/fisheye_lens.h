// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_FISHEYE_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_FISHEYE_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// Models of m = theta e, theta the angle from the optical axis: nothing special happens at 90
/// degrees, and only what lies exactly backwards has no image. n = theta^2.
template <class T>
inline bool not_backwards(const T* P) {
  return P[2] > T(0) || P[0] != T(0) || P[1] != T(0);
}

/// u = f (1 + k n) m + c
struct SimpleRadialFisheyeLens {
  static constexpr int kColmapId = 8;
  static constexpr std::string_view kName = "SIMPLE_RADIAL_FISHEYE";
  static constexpr std::array<std::string_view, 4> kParameters{"f", "cx", "cy", "k"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    const T n = m.x * m.x + m.y * m.y;
    to_pixel<1>(k, m, radial_distortion(m, T(1) + k[3] * n, k[3]), out);
    by_parameter<1>(k, 3, n * m.x, n * m.y, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

/// u = f (1 + k1 n + k2 n^2) m + c
struct RadialFisheyeLens {
  static constexpr int kColmapId = 9;
  static constexpr std::string_view kName = "RADIAL_FISHEYE";
  static constexpr std::array<std::string_view, 5> kParameters{"f", "cx", "cy", "k1", "k2"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    const T n = m.x * m.x + m.y * m.y;
    const T factor = T(1) + n * (k[3] + n * k[4]), slope = k[3] + T(2) * k[4] * n;
    to_pixel<1>(k, m, radial_distortion(m, factor, slope), out);
    by_parameter<1>(k, 3, n * m.x, n * m.y, out);
    by_parameter<1>(k, 4, n * n * m.x, n * n * m.y, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

/// 1 + a n + b n^2 + c n^3 + d n^4 and its slope.
template <class T>
inline std::array<T, 2> quartic(const T& n, const T& a, const T& b, const T& c, const T& d) {
  return {T(1) + n * (a + n * (b + n * (c + n * d))),
          a + n * (T(2) * b + n * (T(3) * c + n * T(4) * d))};
}

/// u = (fx, fy) (1 + k1 n + k2 n^2 + k3 n^3 + k4 n^4) m + c
struct OpencvFisheyeLens {
  static constexpr int kColmapId = 5;
  static constexpr std::string_view kName = "OPENCV_FISHEYE";
  static constexpr std::array<std::string_view, 8> kParameters{"fx", "fy", "cx", "cy",
                                                               "k1", "k2", "k3", "k4"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    const T n = m.x * m.x + m.y * m.y;
    const auto [factor, slope] = quartic(n, k[4], k[5], k[6], k[7]);
    to_pixel<2>(k, m, radial_distortion(m, factor, slope), out);
    T power = n;
    for (int i = 4; i < 8; ++i) {
      by_parameter<2>(k, i, power * m.x, power * m.y, out);
      power = power * n;
    }
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

/// u = (fx, fy) ((1 + k1 n + k2 n^2 + k3 n^3 + k4 n^4) m + tangential + n (sx1, sy1)) + c
struct ThinPrismFisheyeLens {
  static constexpr int kColmapId = 10;
  static constexpr std::string_view kName = "THIN_PRISM_FISHEYE";
  static constexpr std::array<std::string_view, 12> kParameters{
      "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    const T n = m.x * m.x + m.y * m.y;
    const auto [factor, slope] = quartic(n, k[4], k[5], k[8], k[9]);
    Distorted<T> d = radial_distortion(m, factor, slope);
    add_tangential(m, k[6], k[7], d);
    d.x = d.x + k[10] * n;
    d.y = d.y + k[11] * n;
    d.xx = d.xx + T(2) * k[10] * m.x;
    d.xy = d.xy + T(2) * k[10] * m.y;
    d.yx = d.yx + T(2) * k[11] * m.x;
    d.yy = d.yy + T(2) * k[11] * m.y;
    to_pixel<2>(k, m, d, out);
    T power = n;
    for (int i : {4, 5, 8, 9}) {
      by_parameter<2>(k, i, power * m.x, power * m.y, out);
      power = power * n;
    }
    by_tangential<2>(k, 6, m, out);
    by_parameter<2>(k, 10, n, T(0), out);
    by_parameter<2>(k, 11, T(0), n, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_FISHEYE_LENS_H_
