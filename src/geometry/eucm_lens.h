// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_EUCM_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_EUCM_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// The enhanced unified camera model, u = (fx, fy) P.xy / h + c with h = alpha d + (1 - alpha) z
/// and d = sqrt(beta |P.xy|^2 + z^2); 0 <= alpha <= 1, beta > 0. Valid where z > -w d with
/// w = alpha / (1 - alpha) up to alpha = 1/2 and (1 - alpha) / alpha beyond: for alpha above 1/2
/// that is more than 180 degrees.
struct EucmLens {
  static constexpr int kColmapId = 16;
  static constexpr std::string_view kName = "EUCM";
  static constexpr std::array<std::string_view, 6> kParameters{"fx", "fy",    "cx",
                                                               "cy", "alpha", "beta"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    using std::sqrt;
    const T alpha = k[4], beta = k[5];
    const T square = P[0] * P[0] + P[1] * P[1];
    const T d = sqrt(beta * square + P[2] * P[2] + T(kTinySquare));
    const T h = alpha * d + (T(1) - alpha) * P[2];
    const T tiny(1e-18);
    const T ih = T(1) / select(h * h < tiny * tiny, tiny, h), id = T(1) / d;
    const T x = P[0] * ih, y = P[1] * ih;
    const T by_xy = alpha * beta * id * ih, by_z = (alpha * P[2] * id + T(1) - alpha) * ih;
    const OnPlane<T> m{x,
                       y,
                       {{{ih - x * by_xy * P[0], -x * by_xy * P[1], -x * by_z},
                         {-y * by_xy * P[0], ih - y * by_xy * P[1], -y * by_z}}}};
    to_pixel<2>(k, m, {m.x, m.y, T(1), T(0), T(0), T(1)}, out);
    const T by_alpha = (P[2] - d) * ih, by_beta = -alpha * square * id * ih / T(2);
    by_parameter<2>(k, 4, by_alpha * x, by_alpha * y, out);
    by_parameter<2>(k, 5, by_beta * x, by_beta * y, out);
  }
  static bool sees(const double* k, const double* P) {
    const double alpha = k[4];
    const double w = alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
    return P[2] > -w * std::sqrt(k[5] * (P[0] * P[0] + P[1] * P[1]) + P[2] * P[2]);
  }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_EUCM_LENS_H_
