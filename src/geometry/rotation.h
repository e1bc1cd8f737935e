// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

namespace sheaf {

/// Rotations as unit quaternions (w, x, y, z) and row-major 3x3 matrices. `Scalar` is float or
/// double (or a dual number in tests).
template <class Scalar>
using Vector3 = std::array<Scalar, 3>;
template <class Scalar>
using Quaternion = std::array<Scalar, 4>;
template <class Scalar>
using Matrix3 = std::array<Scalar, 9>;

/// exp of the rotation vector phi (radians): q = (cos(a/2), sin(a/2)/a phi), a = |phi|. Valid for
/// every finite phi; below a = 1e-4 the series sin(a/2)/a = 1/2 - a^2/48 is exact to rounding.
template <class Scalar>
Quaternion<Scalar> quaternion_from_angle_axis(const Vector3<Scalar>& phi) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar a2 = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
  if (a2 < Scalar(1e-8)) {
    const Scalar s = Scalar(0.5) - a2 / Scalar(48);
    return {Scalar(1) - a2 / Scalar(8), s * phi[0], s * phi[1], s * phi[2]};
  }
  const Scalar a = sqrt(a2);
  const Scalar s = sin(a / Scalar(2)) / a;
  return {cos(a / Scalar(2)), s * phi[0], s * phi[1], s * phi[2]};
}

/// log: the rotation vector of the unit quaternion q, with angle in [0, pi].
template <class Scalar>
Vector3<Scalar> angle_axis_from_quaternion(const Quaternion<Scalar>& q) {
  using std::atan2;
  using std::sqrt;
  const Scalar s2 = q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  const Scalar sign = q[0] < Scalar(0) ? Scalar(-1) : Scalar(1);
  // For a small angle 2 atan2(s, w) / s -> 2 / w (1 - s^2 / (3 w^2)).
  if (s2 < Scalar(1e-14)) {
    const Scalar k = Scalar(2) / q[0] * (Scalar(1) - s2 / (Scalar(3) * q[0] * q[0]));
    return {k * q[1], k * q[2], k * q[3]};
  }
  const Scalar s = sqrt(s2);
  const Scalar k = Scalar(2) * atan2(s, sign * q[0]) / s * sign;
  return {k * q[1], k * q[2], k * q[3]};
}

/// Hamilton product: the rotation b followed by a.
template <class Scalar>
Quaternion<Scalar> multiply(const Quaternion<Scalar>& a, const Quaternion<Scalar>& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

template <class Scalar>
Quaternion<Scalar> normalized(const Quaternion<Scalar>& q) {
  using std::sqrt;
  const Scalar k = Scalar(1) / sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {k * q[0], k * q[1], k * q[2], k * q[3]};
}

/// Row-major R with R v = q v q*.
template <class Scalar>
Matrix3<Scalar> matrix_from_quaternion(const Quaternion<Scalar>& q) {
  const Scalar w = q[0], x = q[1], y = q[2], z = q[3];
  const Scalar two(2), one(1);
  return {one - two * (y * y + z * z), two * (x * y - w * z),       two * (x * z + w * y),
          two * (x * y + w * z),       one - two * (x * x + z * z), two * (y * z - w * x),
          two * (x * z - w * y),       two * (y * z + w * x),       one - two * (x * x + y * y)};
}

template <class Scalar>
Vector3<Scalar> multiply(const Matrix3<Scalar>& m, const Vector3<Scalar>& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}

template <class Scalar>
Vector3<Scalar> cross(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

}  // namespace sheaf
