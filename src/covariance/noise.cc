// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/noise.h"

#include <algorithm>
#include <cmath>

namespace sheaf {

/// s / (2 sigma^2) is exponentially distributed: the midpoints of equal shares of it.
LossMoments normal_moments(const ScaledLoss& loss, double sigma) {
  if (loss.kind == LossKind::none) return {};
  constexpr int kShares = 4096;
  LossMoments out{0, 0, 0, 0, 0};
  for (int i = 0; i < kShares; ++i) {
    const double s = -2 * sigma * sigma * std::log((i + 0.5) / kShares);
    const LossValue<double> rho = evaluate_loss(loss, s);
    out.weight += rho.first / kShares;
    out.slope += (rho.first + s * rho.second) / kShares;
    out.square += rho.first * rho.first * s / (2 * sigma * sigma) / kShares;
    out.weight_square += rho.first * rho.first / kShares;
    out.slope_square += slope_square(rho, s) / kShares;
  }
  return out;
}

namespace {

/// E[w] / E[slope]^2, corrected for unknowns that are no small part of the rows: Huber's K^2 with K
/// = 1 + unknowns / rows * var(slope) / E[slope]^2 (Robust Statistics, 1981, section 7.6), less
/// what J^T W J itself already has of it, weights varying as they do.
double spread_of(const LossMoments& m, double share) {
  const auto grown = [&](double square, double mean) {
    return 1 + share * std::max(0.0, square / (mean * mean) - 1);
  };
  const double K = grown(m.slope_square, m.slope);
  return m.weight / (m.slope * m.slope) * K * K / grown(m.weight_square, m.weight);
}

}  // namespace

/// Without a loss: the sum of squares by the redundancy. With one: Huber's covariance of an
/// M-estimator, B / A^2 (J^T J)^-1, with J^T W J / E[w] in the place of J^T J, as outliers tell
/// nothing of where things are. B is the mean of w^2 s / 2, corrected for what the fit has taken,
/// and rows count by their weights: what a loss has dropped is no redundancy.
Noise noise_of(const ResidualMoments& m, const ScaledLoss& loss, double stated, double unknowns) {
  constexpr int kRounds = 30;
  Noise out;
  const double rows = 2 * static_cast<double>(m.observations) + static_cast<double>(m.terms);
  out.redundancy = rows - unknowns;
  if (loss.kind == LossKind::none) {
    out.estimated = stated == 0 && out.redundancy > 0;
    out.sigma = stated > 0 ? stated : 1;
    if (out.estimated) out.sigma = std::sqrt((m.square + m.terms_square) / out.redundancy);
    return out;
  }
  if (stated > 0 || out.redundancy <= 0 || !(m.slope > 0)) {
    const LossMoments normal = normal_moments(loss, stated > 0 ? stated : 1);
    out.sigma = stated > 0 ? stated : 1;
    out.factor = normal.square * spread_of(normal, out.redundancy > 0 ? unknowns / rows : 0);
    return out;
  }
  const double n = static_cast<double>(m.observations);
  const double weight = m.weight / n, slope = m.slope / n;
  double sigma = loss.scale_px / tuning_constant(loss.kind);
  double effective = rows;
  for (int round = 0; round < kRounds; ++round) {
    const LossMoments normal = normal_moments(loss, sigma);
    const double share = std::min(1.0, weight / normal.weight);  // of observations that count
    effective = share * 2 * n + static_cast<double>(m.terms);
    const double left = std::max(effective - unknowns, 0.01 * effective);
    const double square = m.square / (2 * n * share) * effective / left;
    sigma = std::sqrt(square / normal.square);
  }
  const LossMoments normal = normal_moments(loss, sigma);
  out.estimated = true;
  out.sigma = sigma;
  out.redundancy = effective - unknowns;
  const double share = std::min(1.0, weight / normal.weight);
  const LossMoments seen{weight / share, slope / share, normal.square, m.weight_square / n / share,
                         m.slope_square / n / share};
  out.factor = normal.square * spread_of(seen, std::min(1.0, unknowns / effective));
  return out;
}

}  // namespace sheaf
