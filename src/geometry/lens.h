// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// For scalars in namespace sheaf; once more on lanes, for each instruction set, in the namespace
// that rows/lens_lanes-inl.h sets: what runs there must be compiled there.
#if !defined(SHEAF_GEOMETRY_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_LENS_H_

#include <array>
#include <cmath>
#include <string_view>

#include "sheaf/camera.h"

#ifndef SHEAF_LENS_NAMESPACE
#define SHEAF_LENS_NAMESPACE sheaf
#endif

namespace SHEAF_LENS_NAMESPACE {

/// The parts that camera models are made of. `T` is a scalar, or lanes with the same operators,
/// functions (sqrt, atan2, tan) and `select`: no body branches on a value.

/// yes where the condition holds, else no. Both have been computed.
template <class T>
inline T select(bool condition, const T& yes, const T& no) {
  return condition ? yes : no;
}

/// A pixel and its derivatives: by the point in the camera's frame, and by the model's parameters
/// in their order (those beyond its count are not touched).
template <class T>
struct LensJacobian {
  std::array<T, 2> pixel;
  std::array<std::array<T, 3>, 2> point;
  std::array<std::array<T, kMaxCameraParameters>, 2> parameters;
};

/// Where a ray meets the plane that distortion acts on, with d/dP.
template <class T>
struct OnPlane {
  T x, y;
  std::array<std::array<T, 3>, 2> d;
};

/// A squared length far below every other in a scene, that keeps 0 / 0 out of the formulas.
inline constexpr double kTinySquare = 1e-36;

/// m = P.xy / P.z. Valid where P.z != 0; the formula continues behind the camera. Nearer to the
/// plane P.z = 0 than 1e-18 it is as if P.z were 1e-18: far out, and finite.
template <class T>
inline OnPlane<T> perspective(const T* P) {
  const T near(1e-18);
  const T z = select(P[2] * P[2] < near * near, near, P[2]);
  const T iz = T(1) / z;
  const T x = P[0] * iz, y = P[1] * iz;
  return {x, y, {{{iz, T(0), -x * iz}, {T(0), iz, -y * iz}}}};
}

/// m = theta e, where theta = atan2(|P.xy|, P.z) is the angle from the optical axis and
/// e = P.xy / |P.xy|. Valid in all directions but exactly backwards:
///   dm/dP.xy = theta / r (I - e e^T) + z / rho^2 e e^T,  dm/dP.z = -r / rho^2 e,
/// r = |P.xy|, rho = |P|.
template <class T>
inline OnPlane<T> equidistant(const T* P) {
  using std::atan2;
  using std::sqrt;
  const T square = P[0] * P[0] + P[1] * P[1] + T(kTinySquare);
  const T r = sqrt(square);
  const T s = atan2(r, P[2]) / r;
  const T inverse = T(1) / (square + P[2] * P[2]);
  const T ex = P[0] / r, ey = P[1] / r;
  const T along = P[2] * inverse - s;
  return {s * P[0],
          s * P[1],
          {{{s + along * ex * ex, along * ex * ey, -P[0] * inverse},
            {along * ex * ey, s + along * ey * ey, -P[1] * inverse}}}};
}

/// What distortion makes of m, with the derivatives by m.
template <class T>
struct Distorted {
  T x, y;
  T xx, xy, yx, yy;  ///< d x / d m.x, d x / d m.y, d y / d m.x, d y / d m.y
};

/// m R(n), n = |m|^2; slope is R'(n).
template <class T>
inline Distorted<T> radial_distortion(const OnPlane<T>& m, const T& factor, const T& slope) {
  const T cross = T(2) * slope * m.x * m.y;
  return {factor * m.x, factor * m.y, factor + T(2) * slope * m.x * m.x,
          cross,        cross,        factor + T(2) * slope * m.y * m.y};
}

/// Adds 2 p1 x y + p2 (n + 2 x^2) and p1 (n + 2 y^2) + 2 p2 x y.
template <class T>
inline void add_tangential(const OnPlane<T>& m, const T& p1, const T& p2, Distorted<T>& out) {
  const T xy = T(2) * m.x * m.y, n = m.x * m.x + m.y * m.y;
  out.x = out.x + p1 * xy + p2 * (n + T(2) * m.x * m.x);
  out.y = out.y + p1 * (n + T(2) * m.y * m.y) + p2 * xy;
  const T cross = T(2) * (p1 * m.x + p2 * m.y);
  out.xx = out.xx + T(2) * p1 * m.y + T(6) * p2 * m.x;
  out.xy = out.xy + cross;
  out.yx = out.yx + cross;
  out.yy = out.yy + T(6) * p1 * m.y + T(2) * p2 * m.x;
}

/// The pixel f d + c and its derivatives by P, f and c. `kFocals` is 1 for f, cx, cy and 2 for
/// fx, fy, cx, cy at the front of the parameters k.
template <int kFocals, class T>
inline void to_pixel(const T* k, const OnPlane<T>& m, const Distorted<T>& d, LensJacobian<T>& out) {
  const T fx = k[0], fy = k[kFocals - 1];
  out.pixel = {fx * d.x + k[kFocals], fy * d.y + k[kFocals + 1]};
  for (int j = 0; j < 3; ++j) {
    out.point[0][j] = fx * (d.xx * m.d[0][j] + d.xy * m.d[1][j]);
    out.point[1][j] = fy * (d.yx * m.d[0][j] + d.yy * m.d[1][j]);
  }
  if constexpr (kFocals == 1) {
    out.parameters[0][0] = d.x, out.parameters[1][0] = d.y;
  } else {
    out.parameters[0][0] = d.x, out.parameters[1][0] = T(0);
    out.parameters[0][1] = T(0), out.parameters[1][1] = d.y;
  }
  out.parameters[0][kFocals] = T(1), out.parameters[1][kFocals] = T(0);
  out.parameters[0][kFocals + 1] = T(0), out.parameters[1][kFocals + 1] = T(1);
}

/// Derivatives by parameter i, given those of the distorted m by it.
template <int kFocals, class T>
inline void by_parameter(const T* k, int i, const T& dx, const T& dy, LensJacobian<T>& out) {
  out.parameters[0][i] = k[0] * dx;
  out.parameters[1][i] = k[kFocals - 1] * dy;
}

/// Derivatives by p1 and p2, parameters i and i + 1.
template <int kFocals, class T>
inline void by_tangential(const T* k, int i, const OnPlane<T>& m, LensJacobian<T>& out) {
  const T xy = T(2) * m.x * m.y, n = m.x * m.x + m.y * m.y;
  by_parameter<kFocals>(k, i, xy, n + T(2) * m.y * m.y, out);
  by_parameter<kFocals>(k, i + 1, n + T(2) * m.x * m.x, xy, out);
}

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_LENS_H_
