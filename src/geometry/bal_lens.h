// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_BAL_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_BAL_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// The camera of BAL files (geometry/bal_camera.h) as one model among the others: u = f d p,
/// p = -P.xy / P.z, d = 1 + k1 n + k2 n^2, n = |p|^2. Not finite where P.z = 0.
struct BalLens {
  static constexpr int kColmapId = -1;  // COLMAP has no such camera
  static constexpr std::string_view kName = "BAL";
  static constexpr std::array<std::string_view, 3> kParameters{"f", "k1", "k2"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const T iz = T(-1) / P[2];
    const T x = P[0] * iz, y = P[1] * iz, n = x * x + y * y;
    const OnPlane<T> m{x, y, {{{iz, T(0), x * iz}, {T(0), iz, y * iz}}}};
    const Distorted<T> d =
        radial_distortion(m, T(1) + n * (k[1] + n * k[2]), k[1] + T(2) * k[2] * n);
    out.pixel = {k[0] * d.x, k[0] * d.y};
    for (int j = 0; j < 3; ++j) {
      out.point[0][j] = k[0] * (d.xx * m.d[0][j] + d.xy * m.d[1][j]);
      out.point[1][j] = k[0] * (d.yx * m.d[0][j] + d.yy * m.d[1][j]);
    }
    out.parameters[0][0] = d.x, out.parameters[1][0] = d.y;
    by_parameter<1>(k, 1, n * x, n * y, out);
    by_parameter<1>(k, 2, n * n * x, n * n * y, out);
  }
  static bool sees(const double*, const double* P) { return P[2] < 0; }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_BAL_LENS_H_
