// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

namespace sheaf::test {

/// A number with N partial derivatives: forward automatic differentiation, for checking the
/// analytic Jacobians. N independent variables are made with Dual::variable.
template <class Scalar, int N>
struct Dual {
  Scalar value{};
  std::array<Scalar, N> d{};

  Dual() = default;
  Dual(Scalar v) : value(v) {}  // NOLINT: constants convert
  static Dual variable(Scalar v, int i) {
    Dual x(v);
    x.d[i] = 1;
    return x;
  }
};

template <class S, int N, class F>
Dual<S, N> combine(S value, const F& derivative) {
  Dual<S, N> out(value);
  for (int i = 0; i < N; ++i) out.d[i] = derivative(i);
  return out;
}

template <class S, int N>
Dual<S, N> operator+(const Dual<S, N>& a, const Dual<S, N>& b) {
  return combine<S, N>(a.value + b.value, [&](int i) { return a.d[i] + b.d[i]; });
}
template <class S, int N>
Dual<S, N> operator-(const Dual<S, N>& a, const Dual<S, N>& b) {
  return combine<S, N>(a.value - b.value, [&](int i) { return a.d[i] - b.d[i]; });
}
template <class S, int N>
Dual<S, N> operator-(const Dual<S, N>& a) {
  return Dual<S, N>(S(0)) - a;
}
template <class S, int N>
Dual<S, N> operator*(const Dual<S, N>& a, const Dual<S, N>& b) {
  return combine<S, N>(a.value * b.value,
                       [&](int i) { return a.d[i] * b.value + a.value * b.d[i]; });
}
template <class S, int N>
Dual<S, N> operator/(const Dual<S, N>& a, const Dual<S, N>& b) {
  return combine<S, N>(a.value / b.value, [&](int i) {
    return (a.d[i] * b.value - a.value * b.d[i]) / (b.value * b.value);
  });
}
template <class S, int N>
bool operator<(const Dual<S, N>& a, const Dual<S, N>& b) {
  return a.value < b.value;
}
template <class S, int N>
Dual<S, N> sqrt(const Dual<S, N>& a) {
  const S root = std::sqrt(a.value);
  return combine<S, N>(root, [&](int i) { return a.d[i] / (2 * root); });
}
template <class S, int N>
Dual<S, N> log1p(const Dual<S, N>& a) {
  return combine<S, N>(std::log1p(a.value), [&](int i) { return a.d[i] / (1 + a.value); });
}
template <class S, int N>
Dual<S, N> sin(const Dual<S, N>& a) {
  return combine<S, N>(std::sin(a.value), [&](int i) { return std::cos(a.value) * a.d[i]; });
}
template <class S, int N>
Dual<S, N> tan(const Dual<S, N>& a) {
  const S t = std::tan(a.value);
  return combine<S, N>(t, [&](int i) { return (1 + t * t) * a.d[i]; });
}
template <class S, int N>
Dual<S, N> atan2(const Dual<S, N>& y, const Dual<S, N>& x) {
  const S square = x.value * x.value + y.value * y.value;
  return combine<S, N>(std::atan2(y.value, x.value),
                       [&](int i) { return (x.value * y.d[i] - y.value * x.d[i]) / square; });
}
template <class S, int N>
Dual<S, N> cos(const Dual<S, N>& a) {
  return combine<S, N>(std::cos(a.value), [&](int i) { return -std::sin(a.value) * a.d[i]; });
}

}  // namespace sheaf::test
