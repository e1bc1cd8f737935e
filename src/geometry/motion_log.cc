// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/motion_log.h"

#include <cmath>

namespace sheaf {
namespace {

Matrix3<double> times(const Matrix3<double>& A, const Matrix3<double>& B) {
  Matrix3<double> out{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) out[3 * r + c] += A[3 * r + k] * B[3 * k + c];
  return out;
}

Matrix3<double> cross_matrix(const Vector3<double>& v) {
  return {0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0};
}

/// Q of the left Jacobian, with P = [phi] and R = [rho]:
///   R / 2 + b (P R + R P + P R P) + c (P P R + R P P - 3 P R P) + e (P R P P + P P R P).
Matrix3<double> coupling(const Vector3<double>& rho, const Vector3<double>& phi) {
  const double a2 = phi[0] * phi[0] + phi[1] * phi[1] + phi[2] * phi[2], a = std::sqrt(a2);
  double b, c, e;
  if (a < 0.1) {
    b = 1.0 / 6 - a2 / 120 + a2 * a2 / 5040;
    c = 1.0 / 24 - a2 / 720 + a2 * a2 / 40320;
    e = 1.0 / 120 - a2 / 2520 + a2 * a2 / 120960;
  } else {
    b = (a - std::sin(a)) / (a2 * a);
    c = (a2 + 2 * std::cos(a) - 2) / (2 * a2 * a2);
    e = (2 * a + a * std::cos(a) - 3 * std::sin(a)) / (2 * a2 * a2 * a);
  }
  const Matrix3<double> P = cross_matrix(phi), R = cross_matrix(rho);
  const Matrix3<double> PR = times(P, R), RP = times(R, P), PRP = times(PR, P);
  const Matrix3<double> PPR = times(P, PR), RPP = times(RP, P);
  const Matrix3<double> PRPP = times(PRP, P), PPRP = times(P, PRP);
  Matrix3<double> Q;
  for (std::size_t i = 0; i < 9; ++i)
    Q[i] = R[i] / 2 + b * (PR[i] + RP[i] + PRP[i]) + c * (PPR[i] + RPP[i] - 3 * PRP[i]) +
           e * (PRPP[i] + PPRP[i]);
  return Q;
}

}  // namespace

std::array<double, 36> inverse_left_jacobian(const std::array<double, 6>& d) {
  const Vector3<double> rho{d[0], d[1], d[2]}, phi{d[3], d[4], d[5]};
  Matrix3<double> inverse;
  for (std::size_t k = 0; k < 3; ++k) {
    Vector3<double> unit{};
    unit[k] = 1;
    const Vector3<double> column = inverse_left_jacobian_times(phi, unit);
    for (std::size_t r = 0; r < 3; ++r) inverse[3 * r + k] = column[r];
  }
  const Matrix3<double> corner = times(inverse, times(coupling(rho, phi), inverse));
  std::array<double, 36> out{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t k = 0; k < 3; ++k) {
      out[6 * r + k] = out[6 * (3 + r) + 3 + k] = inverse[3 * r + k];
      out[6 * r + 3 + k] = -corner[3 * r + k];
    }
  return out;
}

}  // namespace sheaf
