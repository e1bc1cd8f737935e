// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/portable_math.h"

#include <bit>
#include <cmath>
#include <cstdint>

namespace sheaf {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Taylor series on [-pi/4, pi/4]; the first term left out is below 2^-56.
double sine_near_zero(double r) {
  const double n = r * r;
  double sum = 0;
  for (int k = 17; k >= 3; k -= 2) sum = (1 - sum) * n / (k * (k - 1));
  return r - r * sum;
}

double cosine_near_zero(double r) {
  const double n = r * r;
  double sum = 0;
  for (int k = 18; k >= 2; k -= 2) sum = (1 - sum) * n / (k * (k - 1));
  return 1 - sum;
}

// atan of t in [0, 1]: two half-angle steps bring t below tan(pi/16), then the series.
double atan_unit(double t) {
  t = t / (1 + std::sqrt(1 + t * t));
  t = t / (1 + std::sqrt(1 + t * t));
  const double n = t * t;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = n * (1.0 / k - sum);
  return 4 * (t - t * sum);
}

}  // namespace

SineCosine portable_sine_cosine(double x_rad) {
  const double quarter = std::floor(x_rad * (2 / kPi) + 0.5);
  // pi/2 in three parts; the first two have zeros at the end, so that their products are exact.
  const double r =
      ((x_rad - quarter * 1.57079632673412561417e+00) - quarter * 6.07710050630396597660e-11) -
      quarter * 2.02226624879595063154e-21;
  const double s = sine_near_zero(r);
  const double c = cosine_near_zero(r);
  switch (static_cast<std::int64_t>(quarter) & 3) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double portable_atan2(double y, double x) {
  const double a = std::fabs(x);
  const double b = std::fabs(y);
  if (a == 0 && b == 0) return 0;
  double angle = b <= a ? atan_unit(b / a) : kPi / 2 - atan_unit(a / b);
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

double portable_log(double x) {
  // x = m 2^e with m in [sqrt(1/2), sqrt(2)); log m = 2 atanh((m - 1) / (m + 1)).
  const auto bits = std::bit_cast<std::uint64_t>(x);
  int exponent = static_cast<int>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffu) | 0x3ff0000000000000u);
  if (m > 1.41421356237309504880) {
    m *= 0.5;
    ++exponent;
  }
  const double s = (m - 1) / (m + 1);
  const double n = s * s;
  double sum = 0;
  for (int k = 23; k >= 3; k -= 2) sum = n * (1.0 / k + sum);
  constexpr double kLog2High = 6.93147180369123816490e-01;
  constexpr double kLog2Low = 1.90821492927058770002e-10;
  return exponent * kLog2High + (2 * (s + s * sum) + exponent * kLog2Low);
}

}  // namespace sheaf
