// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if !defined(SHEAF_GEOMETRY_EQUIRECTANGULAR_LENS_H_) || defined(SHEAF_LENSES_ON_LANES)
#define SHEAF_GEOMETRY_EQUIRECTANGULAR_LENS_H_

#ifndef SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
#endif

namespace SHEAF_LENS_NAMESPACE {

/// A panorama of all directions, w x h pixels: u = w (theta / 2 pi + 1/2), v = h (phi / pi + 1/2)
/// with the angles theta = atan2(X, Z) about the axis of y and phi = atan2(Y, sqrt(X^2 + Z^2)) down
/// from its equator. There is no behind. Images join at their left and right borders, where theta
/// jumps; at the poles, P.xz = 0, no derivative of u exists, and it is finite.
struct EquirectangularLens {
  static constexpr int kColmapId = 17;
  static constexpr std::string_view kName = "EQUIRECTANGULAR";
  static constexpr std::array<std::string_view, 2> kParameters{"w", "h"};
  static constexpr ParameterSet kImageSize = 3;

  template <class T>
  static void project(const T* k, const T* P, LensJacobian<T>& out) {
    using std::atan2;
    using std::sqrt;
    const T by_turn(0.15915494309189533577), by_half_turn(0.31830988618379067154);
    const T square = P[0] * P[0] + P[2] * P[2] + T(kTinySquare), flat = sqrt(square);
    const T across = atan2(P[0], P[2]) * by_turn + T(0.5);
    const T down = atan2(P[1], flat) * by_half_turn + T(0.5);
    out.pixel = {k[0] * across, k[1] * down};
    const T fx = k[0] * by_turn / square, fy = k[1] * by_half_turn / (square + P[1] * P[1]);
    const T slope = fy * P[1] / flat;
    out.point[0] = {fx * P[2], T(0), -fx * P[0]};
    out.point[1] = {-slope * P[0], fy * flat, -slope * P[2]};
    out.parameters[0][0] = across, out.parameters[1][0] = T(0);
    out.parameters[0][1] = T(0), out.parameters[1][1] = down;
  }
  static bool sees(const double*, const double* P) { return P[0] != 0 || P[1] != 0 || P[2] != 0; }

  /// Of the places x, x + w, x - w, ... of a pixel the one that is nearest to `observed`.
  template <class T>
  static T nearest(const T* k, const T& x, const T& observed) {
    using std::floor;
    return x - k[0] * floor((x - observed) / k[0] + T(0.5));
  }
};

}  // namespace SHEAF_LENS_NAMESPACE

#endif  // SHEAF_GEOMETRY_EQUIRECTANGULAR_LENS_H_
