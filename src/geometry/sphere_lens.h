// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_SPHERE_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_SPHERE_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// Models of a point on a sphere that is seen from elsewhere (or of one more sphere between): u =
/// (fx, fy) P.xy / h + c, where h is a sum of Z and of distances.
template <class T>
struct SphereDepth {
  T h;
  T across, by_z;  ///< dh = across (X dX + Y dY) + by_z dZ
};

template <class T>
inline void project_by_depth(const T* k, const T* P, const SphereDepth<T>& of, const T* by_shape,
                             int shapes, LensJacobian<T>& out) {
  const T tiny(1e-18);
  const T ih = T(1) / select(of.h * of.h < tiny * tiny, tiny, of.h);
  const T x = P[0] * ih, y = P[1] * ih;
  const T by_xy = of.across * ih, by_z = of.by_z * ih;
  const OnPlane<T> m{x,
                     y,
                     {{{ih - x * by_xy * P[0], -x * by_xy * P[1], -x * by_z},
                       {-y * by_xy * P[0], ih - y * by_xy * P[1], -y * by_z}}}};
  to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
  for (int i = 0; i < shapes; ++i)
    by_parameter<2>(k, 4 + i, -by_shape[i] * ih * x, -by_shape[i] * ih * y, out);
}

/// How far behind its plane a unified model sees: Z > -w |P|.
inline double unified_reach(double alpha) {
  return alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
}

/// The unified camera model: h = alpha d + (1 - alpha) Z, d = |P|, 0 <= alpha <= 1; EUCM with beta
/// = 1. Where a lens is stated by xi and gamma, u = gamma P.xy / (Z + xi d) + c, alpha = xi / (1 +
/// xi) and f = gamma / (1 + xi). Valid where Z > -w d with w = alpha / (1 - alpha) up to alpha =
/// 1/2 and (1 - alpha) / alpha beyond.
struct UcmLens {
  static constexpr int kColmapId = -1;  // an EUCM lens with beta = 1
  static constexpr std::string_view kName = "UCM";
  static constexpr std::array<std::string_view, 5> kParameters{"fx", "fy", "cx", "cy", "alpha"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    using std::sqrt;
    const T alpha = k[4];
    const T d = sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2] + T(kTinySquare)), id = T(1) / d;
    const T by_alpha[1] = {d - P[2]};
    project_by_depth(k, P,
                     SphereDepth<T>{alpha * d + (T(1) - alpha) * P[2], alpha * id,
                                    alpha * P[2] * id + T(1) - alpha},
                     by_alpha, 1, out);
  }
  static bool sees(const double* k, const double* P) {
    const double d = std::sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2]);
    return P[2] > -unified_reach(k[4]) * d;
  }
};

/// The double sphere camera model: with d1 = |P|, e = xi d1 + Z and d2 = sqrt(|P.xy|^2 + e^2), h =
/// alpha d2 + (1 - alpha) e; -1 < xi < 1, 0 <= alpha <= 1. Valid where Z > -w2 d1 with
/// w2 = (w1 + xi) / sqrt(2 w1 xi + xi^2 + 1), w1 the w of the unified model.
struct DoubleSphereLens {
  static constexpr int kColmapId = -1;  // COLMAP has no such camera
  static constexpr std::string_view kName = "DOUBLE_SPHERE";
  static constexpr std::array<std::string_view, 6> kParameters{"fx", "fy", "cx",
                                                               "cy", "xi", "alpha"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    using std::sqrt;
    const T xi = k[4], alpha = k[5], rest = T(1) - alpha;
    const T square = P[0] * P[0] + P[1] * P[1];
    const T d1 = sqrt(square + P[2] * P[2] + T(kTinySquare)), id1 = T(1) / d1;
    const T e = xi * d1 + P[2];
    const T d2 = sqrt(square + e * e + T(kTinySquare)), id2 = T(1) / d2;
    const T by_e = alpha * e * id2 + rest;  // dh / de
    const T by_shape[2] = {by_e * d1, d2 - e};
    project_by_depth(k, P,
                     SphereDepth<T>{alpha * d2 + rest * e, alpha * id2 + by_e * xi * id1,
                                    by_e * (xi * P[2] * id1 + T(1))},
                     by_shape, 2, out);
  }
  static bool sees(const double* k, const double* P) {
    const double xi = k[4], w1 = unified_reach(k[5]);
    const double w2 = (w1 + xi) / std::sqrt(2 * w1 * xi + xi * xi + 1);
    return P[2] > -w2 * std::sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2]);
  }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_SPHERE_LENS_H_
