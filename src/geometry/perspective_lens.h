// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_PERSPECTIVE_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_PERSPECTIVE_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// Models of m = P.xy / P.z: they see less than 180 degrees. `sees` is whether P lies before the
/// camera; the formulas continue behind it. n = |m|^2.
template <class T>
inline bool before_plane(const T* P) {
  return P[2] > T(0);
}

/// u = f m + c
struct SimplePinholeLens {
  static constexpr int kColmapId = 0;
  static constexpr std::string_view kName = "SIMPLE_PINHOLE";
  static constexpr std::array<std::string_view, 3> kParameters{"f", "cx", "cy"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    to_pixel<1>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = (fx m.x, fy m.y) + c
struct PinholeLens {
  static constexpr int kColmapId = 1;
  static constexpr std::string_view kName = "PINHOLE";
  static constexpr std::array<std::string_view, 4> kParameters{"fx", "fy", "cx", "cy"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = f (1 + k n) m + c
struct SimpleRadialLens {
  static constexpr int kColmapId = 2;
  static constexpr std::string_view kName = "SIMPLE_RADIAL";
  static constexpr std::array<std::string_view, 4> kParameters{"f", "cx", "cy", "k"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    const T n = m.x * m.x + m.y * m.y;
    to_pixel<1>(k, m, radial_distortion(m, T(1) + k[3] * n, k[3]), out);
    by_parameter<1>(k, 3, n * m.x, n * m.y, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = f (1 + k1 n + k2 n^2) m + c
struct RadialLens {
  static constexpr int kColmapId = 3;
  static constexpr std::string_view kName = "RADIAL";
  static constexpr std::array<std::string_view, 5> kParameters{"f", "cx", "cy", "k1", "k2"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    const T n = m.x * m.x + m.y * m.y;
    const T factor = T(1) + n * (k[3] + n * k[4]), slope = k[3] + T(2) * k[4] * n;
    to_pixel<1>(k, m, radial_distortion(m, factor, slope), out);
    by_parameter<1>(k, 3, n * m.x, n * m.y, out);
    by_parameter<1>(k, 4, n * n * m.x, n * n * m.y, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = f (1 + k1 n + k2 n^2 + k3 n^3) m + c
struct RadialK3Lens {
  static constexpr int kColmapId = -1;  // a FULL_OPENCV lens of one focal length
  static constexpr std::string_view kName = "RADIAL_K3";
  static constexpr std::array<std::string_view, 6> kParameters{"f", "cx", "cy", "k1", "k2", "k3"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    const T n = m.x * m.x + m.y * m.y;
    const T factor = T(1) + n * (k[3] + n * (k[4] + n * k[5]));
    const T slope = k[3] + n * (T(2) * k[4] + T(3) * n * k[5]);
    to_pixel<1>(k, m, radial_distortion(m, factor, slope), out);
    by_parameter<1>(k, 3, n * m.x, n * m.y, out);
    by_parameter<1>(k, 4, n * n * m.x, n * n * m.y, out);
    by_parameter<1>(k, 5, n * n * n * m.x, n * n * n * m.y, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = (fx, fy) ((1 + k1 n + k2 n^2) m + tangential) + c
struct OpencvLens {
  static constexpr int kColmapId = 4;
  static constexpr std::string_view kName = "OPENCV";
  static constexpr std::array<std::string_view, 8> kParameters{"fx", "fy", "cx", "cy",
                                                               "k1", "k2", "p1", "p2"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    const T n = m.x * m.x + m.y * m.y;
    const T factor = T(1) + n * (k[4] + n * k[5]), slope = k[4] + T(2) * k[5] * n;
    Distorted<T> d = radial_distortion(m, factor, slope);
    add_tangential(m, k[6], k[7], d);
    to_pixel<2>(k, m, d, out);
    by_parameter<2>(k, 4, n * m.x, n * m.y, out);
    by_parameter<2>(k, 5, n * n * m.x, n * n * m.y, out);
    by_tangential<2>(k, 6, m, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

/// u = (fx, fy) (A / B m + tangential) + c,
/// A = 1 + k1 n + k2 n^2 + k3 n^3, B = 1 + k4 n + k5 n^2 + k6 n^3. Valid where B != 0.
struct FullOpencvLens {
  static constexpr int kColmapId = 6;
  static constexpr std::string_view kName = "FULL_OPENCV";
  static constexpr std::array<std::string_view, 12> kParameters{"fx", "fy", "cx", "cy", "k1", "k2",
                                                                "p1", "p2", "k3", "k4", "k5", "k6"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const OnPlane<T> m = perspective(P);
    const T n = m.x * m.x + m.y * m.y;
    const T a = T(1) + n * (k[4] + n * (k[5] + n * k[8]));
    const T b = T(1) + n * (k[9] + n * (k[10] + n * k[11]));
    const T da = k[4] + n * (T(2) * k[5] + T(3) * n * k[8]);
    const T db = k[9] + n * (T(2) * k[10] + T(3) * n * k[11]);
    const T ib = T(1) / b, factor = a * ib;
    Distorted<T> d = radial_distortion(m, factor, (da - factor * db) * ib);
    add_tangential(m, k[6], k[7], d);
    to_pixel<2>(k, m, d, out);
    by_tangential<2>(k, 6, m, out);
    const T up = n * ib, down = -factor * up;
    by_parameter<2>(k, 4, up * m.x, up * m.y, out);
    by_parameter<2>(k, 5, n * up * m.x, n * up * m.y, out);
    by_parameter<2>(k, 8, n * n * up * m.x, n * n * up * m.y, out);
    by_parameter<2>(k, 9, down * m.x, down * m.y, out);
    by_parameter<2>(k, 10, n * down * m.x, n * down * m.y, out);
    by_parameter<2>(k, 11, n * n * down * m.x, n * n * down * m.y, out);
  }
  static bool sees(const double*, const double* P) { return before_plane(P); }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_PERSPECTIVE_LENS_H_
