// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/bal_camera.h"
#include "geometry/lens.h"

namespace sheaf {

/// The camera of geometry/bal_camera.h as one model among the others.
struct BalLens {
  static constexpr int kColmapId = -1;  // COLMAP has no such camera
  static constexpr std::string_view kName = "BAL";
  static constexpr std::array<std::string_view, 3> kParameters{"f", "k1", "k2"};

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    const T one(1), zero(0);
    const auto J =
        project_with_jacobian<T>({one, zero, zero, zero, one, zero, zero, zero, one},
                                 {zero, zero, zero}, {k[0], k[1], k[2]}, {P[0], P[1], P[2]});
    out.pixel = J.pixel;
    for (int r = 0; r < 2; ++r)
      for (int j = 0; j < 3; ++j) {
        out.point[r][j] = J.point[3 * r + j];
        out.parameters[r][j] = J.camera[9 * r + 6 + j];
      }
  }
  static bool sees(const double*, const double* P) { return !(P[2] > 0); }
};

}  // namespace sheaf
