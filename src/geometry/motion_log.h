// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/rigid_motion.h"

namespace sheaf {

/// V(phi)^-1 rho, the inverse of left_jacobian_times, for |phi| < 2 pi:
///   I - 1/2 [phi] + (1/a^2 - (1 + cos a) / (2 a sin a)) [phi]^2,  a = |phi|.
template <class Scalar>
Vector3<Scalar> inverse_left_jacobian_times(const Vector3<Scalar>& phi,
                                            const Vector3<Scalar>& rho) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar a2 = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
  Scalar c;
  if (a2 < Scalar(1e-4)) {
    c = (Scalar(1) + a2 / Scalar(60) * (Scalar(1) + a2 / Scalar(42))) / Scalar(12);
  } else {
    // (1 + cos a) / sin a = cot(a / 2)
    const Scalar a = sqrt(a2), half = a / Scalar(2);
    c = Scalar(1) / a2 - cos(half) / (Scalar(2) * a * sin(half));
  }
  const Vector3<Scalar> u = cross(phi, rho);
  const Vector3<Scalar> v = cross(phi, u);
  Vector3<Scalar> out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = rho[k] - u[k] / Scalar(2) + c * v[k];
  return out;
}

/// log on SE(3), (rho, phi) with exp([rho, phi]^) = T; the angle is in [0, pi].
template <class Scalar>
std::array<Scalar, 6> log_of(const RigidMotion<Scalar>& T) {
  const Vector3<Scalar> phi = angle_axis_from_quaternion(T.rotation);
  const Vector3<Scalar> rho = inverse_left_jacobian_times(phi, T.translation);
  return {rho[0], rho[1], rho[2], phi[0], phi[1], phi[2]};
}

/// T^-1.
template <class Scalar>
RigidMotion<Scalar> inverse(const RigidMotion<Scalar>& T) {
  const Quaternion<Scalar>& q = T.rotation;
  const Quaternion<Scalar> back{q[0], -q[1], -q[2], -q[3]};
  const Vector3<Scalar> t = multiply(matrix_from_quaternion(back), T.translation);
  return {back, {-t[0], -t[1], -t[2]}};
}

/// Ad(T) = [R, [t]x R; 0, R], 6 x 6, row-major: T exp(d^) T^-1 = exp((Ad(T) d)^).
inline std::array<double, 36> adjoint_of(const RigidMotion<double>& T) {
  const Matrix3<double> R = matrix_from_quaternion(T.rotation);
  const Vector3<double>& t = T.translation;
  std::array<double, 36> A{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k) {
      A[6 * r + k] = A[6 * (3 + r) + 3 + k] = R[3 * r + k];
      const std::size_t s = (r + 1) % 3, u = (r + 2) % 3;
      A[6 * r + 3 + k] = t[s] * R[3 * u + k] - t[u] * R[3 * s + k];
    }
  return A;
}

/// The derivative of log(exp(d') T) by d' at 0, T = exp(d): the inverse left Jacobian of SE(3), 6 x
/// 6, row-major (Barfoot, State Estimation for Robotics, 2017, section 7.1.5):
///   [J^-1, -J^-1 Q J^-1; 0, J^-1], J = V(phi).
std::array<double, 36> inverse_left_jacobian(const std::array<double, 6>& d);

}  // namespace sheaf
