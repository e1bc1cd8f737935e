// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/rotation.h"

namespace sheaf {

/// SE(3): X -> R X + t, the rotation as a unit quaternion.
template <class Scalar>
struct RigidMotion {
  Quaternion<Scalar> rotation{Scalar(1), Scalar(0), Scalar(0), Scalar(0)};
  Vector3<Scalar> translation{};
};

/// a o b: X -> a(b(X)).
template <class Scalar>
RigidMotion<Scalar> composed(const RigidMotion<Scalar>& a, const RigidMotion<Scalar>& b) {
  const Vector3<Scalar> t = multiply(matrix_from_quaternion(a.rotation), b.translation);
  return {normalized(multiply(a.rotation, b.rotation)),
          {t[0] + a.translation[0], t[1] + a.translation[1], t[2] + a.translation[2]}};
}

/// V(phi) rho with V = I + (1 - cos a)/a^2 [phi] + (a - sin a)/a^3 [phi]^2, a = |phi|: the
/// translation of exp([rho, phi]^) on SE(3). Series below a = 1e-2 (error < 1e-17 relative).
template <class Scalar>
Vector3<Scalar> left_jacobian_times(const Vector3<Scalar>& phi, const Vector3<Scalar>& rho) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar a2 = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2];
  Scalar b, c;
  if (a2 < Scalar(1e-4)) {
    b = Scalar(0.5) -
        a2 / Scalar(24) * (Scalar(1) - a2 / Scalar(30) * (Scalar(1) - a2 / Scalar(56)));
    c = Scalar(1) / Scalar(6) -
        a2 / Scalar(120) * (Scalar(1) - a2 / Scalar(42) * (Scalar(1) - a2 / Scalar(72)));
  } else {
    const Scalar a = sqrt(a2);
    const Scalar s = sin(a / Scalar(2));
    b = Scalar(2) * s * s / a2;  // (1 - cos a) / a^2 without cancellation
    c = (a - sin(a)) / (a2 * a);
  }
  const Vector3<Scalar> u = cross(phi, rho);
  const Vector3<Scalar> v = cross(phi, u);
  return {rho[0] + b * u[0] + c * v[0], rho[1] + b * u[1] + c * v[1], rho[2] + b * u[2] + c * v[2]};
}

/// Left perturbation on SE(3), translation first: exp([rho, phi]^) T. The quaternion is normalised
/// again, so that its norm never drifts.
template <class Scalar>
RigidMotion<Scalar> left_perturbed(const RigidMotion<Scalar>& T, const Vector3<Scalar>& rho,
                                   const Vector3<Scalar>& phi) {
  const Quaternion<Scalar> q = quaternion_from_angle_axis(phi);
  const Vector3<Scalar> rotated = multiply(matrix_from_quaternion(q), T.translation);
  const Vector3<Scalar> moved = left_jacobian_times(phi, rho);
  return {normalized(multiply(q, T.rotation)),
          {rotated[0] + moved[0], rotated[1] + moved[1], rotated[2] + moved[2]}};
}

}  // namespace sheaf
