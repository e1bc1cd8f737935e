// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "image/grey.h"

namespace sheaf {

/// How an image is read between its pixels. All three are separable and touch four pixels along
/// each axis, at floor(x) - 1 to floor(x) + 2; only the weights differ.
enum class Taps {
  bilinear_central,  ///< bilinear; its slope is the bilinear interpolation of central differences
  bilinear,          ///< bilinear, with its own slope: constant within a cell, jumps between cells
  catmull_rom,       ///< cubic through the pixels, continuous slope, exact derivative
};

/// Weights of the four pixels at the fraction f in [0, 1) of a cell: their sum is 1 for the value
/// and 0 for its slope (per pixel).
struct TapWeights {
  double value[4], slope[4];
};

inline TapWeights tap_weights(Taps taps, double f) {
  switch (taps) {
    case Taps::bilinear_central:
      return {{0, 1 - f, f, 0}, {(f - 1) / 2, -f / 2, (1 - f) / 2, f / 2}};
    case Taps::bilinear:
      return {{0, 1 - f, f, 0}, {0, -1, 1, 0}};
    case Taps::catmull_rom:
      break;
  }
  return {{f * (f * (1 - f / 2) - 0.5), 1 + f * f * (1.5 * f - 2.5), f * (0.5 + f * (2 - 1.5 * f)),
           f * f * (f - 1) / 2},
          {f * (2 - 1.5 * f) - 0.5, f * (4.5 * f - 5), 0.5 + f * (4 - 4.5 * f), f * (1.5 * f - 1)}};
}

struct GreySample {
  double value, dx, dy;  ///< grey level, and its slope per pixel along x and y
};

/// At (x, y) with -1 <= x <= width, -1 <= y <= height.
inline GreySample sample(const GreyPlane& plane, Taps taps, double x, double y) {
  const double x0 = std::floor(x), y0 = std::floor(y);
  const TapWeights wx = tap_weights(taps, x - x0), wy = tap_weights(taps, y - y0);
  const float* corner = plane.at(static_cast<int>(x0) - 1, static_cast<int>(y0) - 1);
  GreySample out{0, 0, 0};
  for (int r = 0; r < 4; ++r) {
    const float* p = corner + r * plane.stride();
    double value = 0, slope = 0;
    for (int c = 0; c < 4; ++c) value += wx.value[c] * p[c], slope += wx.slope[c] * p[c];
    out.value += wy.value[r] * value;
    out.dx += wy.value[r] * slope;
    out.dy += wy.slope[r] * value;
  }
  return out;
}

}  // namespace sheaf
