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

/// u = f m + c
struct SimpleFisheyeLens {
  static constexpr int kColmapId = 14;
  static constexpr std::string_view kName = "SIMPLE_FISHEYE";
  static constexpr std::array<std::string_view, 3> kParameters{"f", "cx", "cy"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    to_pixel<1>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

/// u = (fx m.x, fy m.y) + c
struct FisheyeLens {
  static constexpr int kColmapId = 15;
  static constexpr std::string_view kName = "FISHEYE";
  static constexpr std::array<std::string_view, 4> kParameters{"fx", "fy", "cx", "cy"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }
};

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

/// u = (fx, fy) (w + tangential(w) + q (s0, s2) + q^2 (s1, s3)) + c with
/// w = (1 + k0 n + k1 n^2 + ... + k5 n^6) m and q = |w|^2: tangential and prism distortion act on
/// what radial distortion made. p0 is the p2 of the other models, p1 their p1.
struct RadTanThinPrismFisheyeLens {
  static constexpr int kColmapId = 11;
  static constexpr std::string_view kName = "RAD_TAN_THIN_PRISM_FISHEYE";
  static constexpr std::array<std::string_view, 16> kParameters{"fx", "fy", "cx", "cy", "k0", "k1",
                                                                "k2", "k3", "k4", "k5", "p0", "p1",
                                                                "s0", "s1", "s2", "s3"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = equidistant(P);
    const T n = m.x * m.x + m.y * m.y;
    const OnPlane<T> w = radially(k, m, n);
    const T q = w.x * w.x + w.y * w.y;
    Distorted<T> d{w.x, w.y, T(1), T(0), T(0), T(1)};
    add_tangential(w, k[11], k[10], d);
    const T across = q * (k[12] + q * k[13]), down = q * (k[14] + q * k[15]);
    const T by_across = T(2) * (k[12] + T(2) * q * k[13]);  // d across / d w = by_across w
    const T by_down = T(2) * (k[14] + T(2) * q * k[15]);
    d.x = d.x + across, d.xx = d.xx + by_across * w.x, d.xy = d.xy + by_across * w.y;
    d.y = d.y + down, d.yx = d.yx + by_down * w.x, d.yy = d.yy + by_down * w.y;
    to_pixel<2>(k, w, d, out);
    T power = n;
    for (int i = 4; i < 10; ++i) {
      const T x = power * m.x, y = power * m.y;
      by_parameter<2>(k, i, d.xx * x + d.xy * y, d.yx * x + d.yy * y, out);
      power = power * n;
    }
    const T xy = T(2) * w.x * w.y;
    by_parameter<2>(k, 10, q + T(2) * w.x * w.x, xy, out);
    by_parameter<2>(k, 11, xy, q + T(2) * w.y * w.y, out);
    by_parameter<2>(k, 12, q, T(0), out);
    by_parameter<2>(k, 13, q * q, T(0), out);
    by_parameter<2>(k, 14, T(0), q, out);
    by_parameter<2>(k, 15, T(0), q * q, out);
  }
  static bool sees(const double*, const double* P) { return not_backwards(P); }

 private:
  /// w and its derivatives by P.
  template <class T>
  static OnPlane<T> radially(const T* k, const OnPlane<T>& m, const T& n) {
    T factor = k[9], slope = T(6) * k[9];
    for (int i = 5; i > 0; --i) {
      factor = k[3 + i] + n * factor;
      slope = T(i) * k[3 + i] + n * slope;
    }
    factor = T(1) + n * factor;
    const Distorted<T> d = radial_distortion(m, factor, slope);
    OnPlane<T> w{d.x, d.y, {}};
    for (int j = 0; j < 3; ++j) {
      w.d[0][j] = d.xx * m.d[0][j] + d.xy * m.d[1][j];
      w.d[1][j] = d.yx * m.d[0][j] + d.yy * m.d[1][j];
    }
    return w;
  }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_FISHEYE_LENS_H_
