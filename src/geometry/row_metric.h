// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "geometry/loss.h"

namespace sheaf {

/// What a loss makes of the two rows of an observation (docs/math.md, section 12). With s = |r|^2,
/// w = rho'(s) and phi = max(delta, 1 + 2 rho'' s / rho'), delta being the loss's `floor`, the rows
/// and the residual that stand for them in a least-squares step are
///   N J,  N = sqrt(w) (I - (1 - sqrt(phi)) r r^T / s),   and  sqrt(w / phi) r:
/// the gradient N^T sqrt(w / phi) r = w r is that of the loss, and the curvature is
///   M = N^T N = w I - u u^T,  u = sqrt(w (1 - phi) / s) r.
struct RowMetric {
  double w = 1;
  std::array<double, 2> u{};

  /// M e.
  std::array<double, 2> times(const std::array<double, 2>& e) const {
    const double along = u[0] * e[0] + u[1] * e[1];
    return {w * e[0] - u[0] * along, w * e[1] - u[1] * along};
  }
  /// N e.
  std::array<double, 2> root_times(const std::array<double, 2>& e) const {
    if (w <= 0) return {0, 0};
    const double root = std::sqrt(w), phi = std::max(0.0, 1 - (u[0] * u[0] + u[1] * u[1]) / w);
    const double along = (u[0] * e[0] + u[1] * e[1]) / (root * (1 + std::sqrt(phi)));
    return {root * e[0] - u[0] * along, root * e[1] - u[1] * along};
  }
};

/// phi: the curvature of rho(|r|^2) along r as a part of that across, not below the loss's floor.
inline double curvature_along(const ScaledLoss& loss, const LossValue<double>& rho, double s) {
  if (!(rho.first > 0)) return 1;
  return std::max(loss.floor, 1 + 2 * rho.second * s / rho.first);
}

inline RowMetric metric_of(const ScaledLoss& loss, const LossValue<double>& rho,
                           const std::array<double, 2>& r) {
  const double s = r[0] * r[0] + r[1] * r[1];
  const double phi = curvature_along(loss, rho, s);
  const double by = s > 0 && phi < 1 ? std::sqrt(rho.first * (1 - phi) / s) : 0;
  return {rho.first, {by * r[0], by * r[1]}};
}

/// Of rows by pixels, 1 / inverse_sigma of which count as one: their residual is r.
inline RowMetric weighed_metric(const ScaledLoss& loss, const std::array<double, 2>& r,
                                double inverse_sigma) {
  const std::array<double, 2> x{inverse_sigma * r[0], inverse_sigma * r[1]};
  const RowMetric m = metric_of(loss, evaluate_loss(loss, x[0] * x[0] + x[1] * x[1]), x);
  return {inverse_sigma * inverse_sigma * m.w, {inverse_sigma * m.u[0], inverse_sigma * m.u[1]}};
}

/// The loss's rows of an observation of any kind: with member r and visit_columns(f), which calls
/// f(j0, j1) for the two entries of each column. Returns rho of what the residual was, in
/// sigmas.
template <class Row>
LossValue<double> apply_loss(const ScaledLoss& loss, Row& row, double inverse_sigma = 1) {
  for (double& x : row.r) x *= inverse_sigma;
  const double s = row.square();
  const LossValue<double> rho = evaluate_loss(loss, s);
  const double phi = curvature_along(loss, rho, s), root = std::sqrt(rho.first);
  const double shorter = s > 0 ? (1 - std::sqrt(phi)) / s : 0;
  const std::array<double, 2> r = row.r;
  row.visit_columns([&](double& j0, double& j1) {
    const double along = shorter * (r[0] * j0 + r[1] * j1);
    j0 = inverse_sigma * root * (j0 - r[0] * along);
    j1 = inverse_sigma * root * (j1 - r[1] * along);
  });
  for (double& x : row.r) x *= root / std::sqrt(phi);
  return rho;
}

}  // namespace sheaf
