// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "geometry/rotation.h"

namespace sheaf {

/// The camera of "Bundle Adjustment in the Large": it looks along -z; f in pixels, k1 and k2
/// without unit; the pixel origin is the image centre, y up.
template <class Scalar>
struct BalCamera {
  Scalar f{1}, k1{0}, k2{0};
};

/// Pixel of the point P in the camera's frame:
///   p = -P.xy / P.z,  n = |p|^2,  u = f (1 + k1 n + k2 n^2) p.
/// Finite wherever P.z != 0; the formula continues through the sign of P.z, where the point lies
/// behind the camera.
template <class Scalar>
std::array<Scalar, 2> project(const BalCamera<Scalar>& camera, const Vector3<Scalar>& P) {
  const Scalar x = -P[0] / P[2];
  const Scalar y = -P[1] / P[2];
  const Scalar n = x * x + y * y;
  const Scalar d = camera.f * (Scalar(1) + n * (camera.k1 + n * camera.k2));
  return {d * x, d * y};
}

/// Derivatives of the pixel, row-major. docs/math.md derives them.
template <class Scalar>
struct BalJacobian {
  std::array<Scalar, 2> pixel;
  std::array<Scalar, 18>
      camera;                   ///< 2x9: [rho (3), phi (3), f, k1, k2], left perturbation of SE(3)
  std::array<Scalar, 6> point;  ///< 2x3: d pixel / d X (world)
};

/// Pixel and exact Jacobians of u = project(R X + t), R row-major.
///   A = du/dP = (f d I + dd p p^T) (-1/P.z) [I | p],  dd = f (2 k1 + 4 k2 n)
///   d/d rho = A,  d/d phi = -A [P]_x,  d/df = d p,  d/dk1 = f n p,  d/dk2 = f n^2 p,  d/dX = A R.
/// Valid wherever P.z != 0.
template <class Scalar>
BalJacobian<Scalar> project_with_jacobian(const Matrix3<Scalar>& R, const Vector3<Scalar>& t,
                                          const BalCamera<Scalar>& camera,
                                          const Vector3<Scalar>& X) {
  const Vector3<Scalar> q = multiply(R, X);
  const Vector3<Scalar> P = {q[0] + t[0], q[1] + t[1], q[2] + t[2]};
  const Scalar iz = Scalar(-1) / P[2];
  const std::array<Scalar, 2> p = {P[0] * iz, P[1] * iz};
  const Scalar n = p[0] * p[0] + p[1] * p[1];
  const Scalar d = Scalar(1) + n * (camera.k1 + n * camera.k2);
  const Scalar fd = camera.f * d;
  const Scalar dd = camera.f * (Scalar(2) * camera.k1 + Scalar(4) * camera.k2 * n);

  BalJacobian<Scalar> out;
  out.pixel = {fd * p[0], fd * p[1]};
  for (int r = 0; r < 2; ++r) {
    const Scalar a0 = ((r == 0 ? fd : Scalar(0)) + dd * p[r] * p[0]) * iz;
    const Scalar a1 = ((r == 1 ? fd : Scalar(0)) + dd * p[r] * p[1]) * iz;
    const Scalar a2 = a0 * p[0] + a1 * p[1];
    Scalar* c = &out.camera[9 * r];
    c[0] = a0, c[1] = a1, c[2] = a2;
    c[3] = a2 * P[1] - a1 * P[2];
    c[4] = a0 * P[2] - a2 * P[0];
    c[5] = a1 * P[0] - a0 * P[1];
    c[6] = d * p[r];
    c[7] = camera.f * n * p[r];
    c[8] = camera.f * n * n * p[r];
    for (int j = 0; j < 3; ++j) out.point[3 * r + j] = a0 * R[j] + a1 * R[3 + j] + a2 * R[6 + j];
  }
  return out;
}

}  // namespace sheaf
