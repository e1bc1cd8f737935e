// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

namespace sheaf {

/// The inverse of a symmetric 3 x 3; false where it is singular: a pivot of its factor falls below
/// `least` of the diagonal.
inline bool invert3(const std::array<double, 9>& V, double least, std::array<double, 9>& out) {
  const double l00 = std::sqrt(V[0]), l10 = V[3] / l00, l20 = V[6] / l00;
  const double d1 = V[4] - l10 * l10, l11 = std::sqrt(d1), l21 = (V[7] - l20 * l10) / l11;
  const double d2 = V[8] - l20 * l20 - l21 * l21, l22 = std::sqrt(d2);
  if (!(V[0] > 0) || !(d1 > least * V[4]) || !(d2 > least * V[8])) return false;
  // L^-1, then L^-T L^-1
  const double i00 = 1 / l00, i11 = 1 / l11, i22 = 1 / l22;
  const double i10 = -l10 * i00 * i11, i21 = -l21 * i11 * i22;
  const double i20 = -(l20 * i00 + l21 * i10) * i22;
  out[0] = i00 * i00 + i10 * i10 + i20 * i20;
  out[1] = out[3] = i10 * i11 + i20 * i21;
  out[2] = out[6] = i20 * i22;
  out[4] = i11 * i11 + i21 * i21;
  out[5] = out[7] = i21 * i22;
  out[8] = i22 * i22;
  return true;
}

}  // namespace sheaf
