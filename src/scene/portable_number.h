// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "platform/portable_math.h"

namespace sheaf {

/// A double whose functions have the same bits on every machine: the scalar with which lenses
/// (geometry/lens.h) make measurements.
struct PortableNumber {
  double value = 0;
  PortableNumber() = default;
  explicit PortableNumber(double x) : value(x) {}
  PortableNumber operator-() const { return PortableNumber(-value); }
};

inline PortableNumber operator+(PortableNumber a, PortableNumber b) {
  return PortableNumber(a.value + b.value);
}
inline PortableNumber operator-(PortableNumber a, PortableNumber b) {
  return PortableNumber(a.value - b.value);
}
inline PortableNumber operator*(PortableNumber a, PortableNumber b) {
  return PortableNumber(a.value * b.value);
}
inline PortableNumber operator/(PortableNumber a, PortableNumber b) {
  return PortableNumber(a.value / b.value);
}
inline bool operator<(PortableNumber a, PortableNumber b) { return a.value < b.value; }

inline PortableNumber sqrt(PortableNumber x) { return PortableNumber(std::sqrt(x.value)); }
inline PortableNumber atan2(PortableNumber y, PortableNumber x) {
  return PortableNumber(portable_atan2(y.value, x.value));
}
inline PortableNumber tan(PortableNumber x) {
  const SineCosine of = portable_sine_cosine(x.value);
  return PortableNumber(of.sine / of.cosine);
}

}  // namespace sheaf
