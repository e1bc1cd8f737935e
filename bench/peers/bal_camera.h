// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// BAL's projection with its exact derivatives by hand, written apart from the engine's own: the
// peers get derivatives as quick as ours, and the two hold each other to account.
#pragma once

#include <cmath>

namespace peer {

/// P = R X + t, R row-major.
struct Pose {
  double R[9];
  double t[3];
};

/// Derivatives of the 2 residuals (px). Null pointers are skipped.
struct Derivatives {
  double by_P[6];     ///< 2x3, by P = R X + t
  double by_lens[6];  ///< 2x3, by f, k1, k2
};

/// r = f (1 + k1 n + k2 n^2) p - measured, p = -P.xy / P.z, n = |p|^2. Valid where P.z != 0.
/// P (3) comes back too. `derivatives` may be null.
inline void project(const Pose& pose, const double* lens, const double* X, const double* measured,
                    double* P, double* residual, Derivatives* derivatives) {
  for (int i = 0; i < 3; ++i)
    P[i] = pose.R[3 * i] * X[0] + pose.R[3 * i + 1] * X[1] + pose.R[3 * i + 2] * X[2] + pose.t[i];
  const double inverse_z = -1.0 / P[2];
  const double x = P[0] * inverse_z, y = P[1] * inverse_z;
  const double n = x * x + y * y;
  const double f = lens[0], k1 = lens[1], k2 = lens[2];
  const double distortion = 1.0 + n * (k1 + k2 * n);
  const double scale = f * distortion;
  residual[0] = scale * x - measured[0];
  residual[1] = scale * y - measured[1];
  if (!derivatives) return;
  // d(scale p)/dp = scale I + 2 f (k1 + 2 k2 n) p p^T;  dp/dP = inverse_z [I, p]
  const double slope = 2.0 * f * (k1 + 2.0 * k2 * n);
  const double xx = (scale + slope * x * x) * inverse_z;
  const double xy = slope * x * y * inverse_z;
  const double yy = (scale + slope * y * y) * inverse_z;
  double* by_P = derivatives->by_P;
  by_P[0] = xx, by_P[1] = xy, by_P[2] = xx * x + xy * y;
  by_P[3] = xy, by_P[4] = yy, by_P[5] = xy * x + yy * y;
  double* by_lens = derivatives->by_lens;
  by_lens[0] = distortion * x, by_lens[1] = f * n * x, by_lens[2] = f * n * n * x;
  by_lens[3] = distortion * y, by_lens[4] = f * n * y, by_lens[5] = f * n * n * y;
}

/// row (1x3) times -[q]x, q = R X: the derivative by a left turn R <- exp(phi) R.
inline void times_minus_cross(const double* row, const double* q, double* out) {
  out[0] = q[1] * row[2] - q[2] * row[1];
  out[1] = q[2] * row[0] - q[0] * row[2];
  out[2] = q[0] * row[1] - q[1] * row[0];
}

/// Rotation of an angle-axis vector w, and (when asked) the left Jacobian J of SO(3):
/// exp(w + d) = exp(J d) exp(w) to first order. Both row-major, both by series near zero.
inline void rotation(const double* w, double* R, double* J) {
  const double s = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  double a, b, c;  // sin(t)/t, (1 - cos t)/t^2, (t - sin t)/t^3
  if (s > 1e-3) {
    const double t = std::sqrt(s), half = std::sin(0.5 * t);
    a = std::sin(t) / t, b = 2.0 * half * half / s, c = (1.0 - a) / s;
  } else {  // the next terms are below 3e-17
    a = 1.0 - s * (1.0 / 6 - s * (1.0 / 120 - s / 5040));
    b = 0.5 - s * (1.0 / 24 - s * (1.0 / 720 - s / 40320));
    c = 1.0 / 6 - s * (1.0 / 120 - s * (1.0 / 5040 - s / 362880));
  }
  const double W[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double square = w[i] * w[j] - (i == j ? s : 0.0);  // [w]x^2
      R[3 * i + j] = (i == j) + a * W[3 * i + j] + b * square;
      if (J) J[3 * i + j] = (i == j) + b * W[3 * i + j] + c * square;
    }
}

/// The angle-axis vector of the rotation nearest to R (row-major), which may have lost its last
/// digits: R <- (R + R^-T) / 2 thrice, then by the quaternion's largest entry. |w| <= pi.
inline void angle_axis(double* R, double* w) {
  for (int turn = 0; turn < 3; ++turn) {
    double C[9];  // cofactors: R^-T = C / det
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
        C[3 * i + j] = R[3 * a + c] * R[3 * b + d] - R[3 * a + d] * R[3 * b + c];
      }
    const double det = R[0] * C[0] + R[1] * C[1] + R[2] * C[2];
    for (int i = 0; i < 9; ++i) R[i] = 0.5 * (R[i] + C[i] / det);
  }
  // 4 q_i q_j, w first.
  const double squares[4] = {1 + R[0] + R[4] + R[8], 1 + R[0] - R[4] - R[8], 1 - R[0] + R[4] - R[8],
                             1 - R[0] - R[4] + R[8]};
  const double products[4][4] = {{squares[0], R[7] - R[5], R[2] - R[6], R[3] - R[1]},
                                 {R[7] - R[5], squares[1], R[1] + R[3], R[2] + R[6]},
                                 {R[2] - R[6], R[1] + R[3], squares[2], R[5] + R[7]},
                                 {R[3] - R[1], R[2] + R[6], R[5] + R[7], squares[3]}};
  int largest = 0;
  for (int i = 1; i < 4; ++i)
    if (squares[i] > squares[largest]) largest = i;
  double q[4];
  const double sign = products[largest][0] < 0 ? -1 : 1;  // q[0] >= 0
  for (int i = 0; i < 4; ++i)
    q[i] = sign * products[largest][i] / (2 * std::sqrt(squares[largest]));
  const double sine = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double scale = sine > 1e-12 ? 2 * std::atan2(sine, q[0]) / sine : 2;
  for (int i = 0; i < 3; ++i) w[i] = scale * q[1 + i];
}

}  // namespace peer
