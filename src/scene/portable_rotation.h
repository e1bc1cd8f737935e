// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "geometry/rotation.h"
#include "platform/portable_math.h"

namespace sheaf {

/// The conversions of geometry/rotation.h with the same bits on every machine, for making scenes.
inline Quaternion<double> portable_quaternion(const Vector3<double>& phi) {
  const double a = std::sqrt(phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2]);
  const SineCosine half = portable_sine_cosine(a / 2);
  const double s = a < 1e-150 ? 0.5 : half.sine / a;
  return {half.cosine, s * phi[0], s * phi[1], s * phi[2]};
}

/// Angle in [0, pi].
inline Vector3<double> portable_angle_axis(const Quaternion<double>& q) {
  const double sign = q[0] < 0 ? -1 : 1;
  const double s = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double k = s < 1e-150 ? 2 : sign * 2 * portable_atan2(s, sign * q[0]) / s;
  return {k * q[1], k * q[2], k * q[3]};
}

/// Of a rotation matrix, row-major. The largest of the four components is found first, so that
/// nothing is divided by a small number.
inline Quaternion<double> portable_quaternion(const Matrix3<double>& R) {
  const double squares[4] = {1 + R[0] + R[4] + R[8], 1 + R[0] - R[4] - R[8], 1 - R[0] + R[4] - R[8],
                             1 - R[0] - R[4] + R[8]};
  int largest = 0;
  for (int i = 1; i < 4; ++i)
    if (squares[i] > squares[largest]) largest = i;
  // Row `largest` of 4 q q^T.
  const double rows[4][4] = {{squares[0], R[7] - R[5], R[2] - R[6], R[3] - R[1]},
                             {R[7] - R[5], squares[1], R[1] + R[3], R[2] + R[6]},
                             {R[2] - R[6], R[1] + R[3], squares[2], R[5] + R[7]},
                             {R[3] - R[1], R[2] + R[6], R[5] + R[7], squares[3]}};
  Quaternion<double> q = {rows[largest][0], rows[largest][1], rows[largest][2], rows[largest][3]};
  return normalized(q);
}

inline Matrix3<double> portable_matrix(const Quaternion<double>& q) {
  return matrix_from_quaternion(q);
}

}  // namespace sheaf
