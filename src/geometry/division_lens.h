// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_DIVISION_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_DIVISION_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// Fitzgibbon's division model, by which undistorting is a quotient: the ray of a pixel at
/// d = (u - c) / f is (d, 1 + k |d|^2). So d = g P.xy, where g solves k r^2 g^2 - Z g + 1 = 0 and
/// is 1 / Z without distortion:
///   g = 2 / (Z + D),  D = sqrt(Z^2 - 4 k r^2),  r = |P.xy|.
/// With k < 0 that is defined in all directions but exactly backwards. With k >= 0 it is where
/// Z >= 2 sqrt(k) r, at whose border pixels end; the formula continues behind the camera by the
/// other sign of D, and between the two, where there is no root, with D = 0.
template <class T>
struct Divided {
  T g;                  ///< d = g P.xy
  T along, by_z, by_k;  ///< dg = along (X dX + Y dY) + by_z dZ + by_k dk
};

template <class T>
inline Divided<T> divided(const T* P, const T& k) {
  using std::sqrt;
  const T none(0), tiny(1e-18);
  const T Z = select(P[2] * P[2] < tiny * tiny, tiny, P[2]);
  const T square = P[0] * P[0] + P[1] * P[1];
  const T inside = Z * Z - T(4) * k * square;
  const auto no_root = inside < tiny * tiny;
  const T root = sqrt(select(no_root, tiny * tiny, inside));
  const auto behind = Z < none, inward = k < none;
  // Without cancellation: Z + D = -4 k r^2 / (D - Z) behind the camera's plane.
  const T beyond = T(-4) * k * square / (root - Z);
  const T wide = select(beyond < tiny, tiny, beyond);
  const T sum = select(behind, select(inward, wide, Z - root), Z + root);
  // D with the sign that it has in the sum, and at its place where there is no root.
  const T signed_root = select(behind, select(inward, root, -root), root);
  const T g = T(2) / select(no_root, Z, sum);
  const T down = select(no_root, none, g / signed_root);
  return {g, T(2) * k * g * down, select(no_root, -g / Z, -down), square * g * down};
}

template <class T>
inline OnPlane<T> on_plane(const Divided<T>& of, const T* P) {
  OnPlane<T> m{of.g * P[0], of.g * P[1], {}};
  for (int r = 0; r < 2; ++r) {
    for (int j = 0; j < 2; ++j) m.d[r][j] = of.along * P[r] * P[j];
    m.d[r][r] = m.d[r][r] + of.g;
    m.d[r][2] = of.by_z * P[r];
  }
  return m;
}

inline bool division_sees(double k, const double* P) {
  const double square = P[0] * P[0] + P[1] * P[1];
  if (k < 0) return P[2] > 0 || square > 0;
  return P[2] > 0 && P[2] * P[2] >= 4 * k * square;
}

/// u = f d + c
struct SimpleDivisionLens {
  static constexpr int kColmapId = 12;
  static constexpr std::string_view kName = "SIMPLE_DIVISION";
  static constexpr std::array<std::string_view, 4> kParameters{"f", "cx", "cy", "k"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const Divided<T> of = divided(P, k[3]);
    const OnPlane<T> m = on_plane(of, P);
    to_pixel<1>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
    by_parameter<1>(k, 3, of.by_k * P[0], of.by_k * P[1], out);
  }
  static bool sees(const double* k, const double* P) { return division_sees(k[3], P); }
};

/// u = (fx d.x, fy d.y) + c
struct DivisionLens {
  static constexpr int kColmapId = 13;
  static constexpr std::string_view kName = "DIVISION";
  static constexpr std::array<std::string_view, 5> kParameters{"fx", "fy", "cx", "cy", "k"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const Divided<T> of = divided(P, k[4]);
    const OnPlane<T> m = on_plane(of, P);
    to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
    by_parameter<2>(k, 4, of.by_k * P[0], of.by_k * P[1], out);
  }
  static bool sees(const double* k, const double* P) { return division_sees(k[4], P); }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_DIVISION_LENS_H_
