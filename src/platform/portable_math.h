// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// Elementary functions out of + - * / and sqrt alone, in a fixed order: IEEE 754 rounds these
/// correctly, so the result has the same bits on every machine, which no libm promises. They are
/// for making data (scenes, noise), not for hot loops.
struct SineCosine {
  double sine;
  double cosine;
};

/// Within 2e-16 for |x_rad| <= 1e4.
SineCosine portable_sine_cosine(double x_rad);

/// Angle of the vector (x, y) in [-pi, pi], within 4 ulp; 0 for (0, 0).
double portable_atan2(double y, double x);

/// Natural logarithm of a normal x > 0, within 2 ulp away from x = 1.
double portable_log(double x);

}  // namespace sheaf
