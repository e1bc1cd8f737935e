// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "sheaf/loss.h"

namespace sheaf {

/// A loss whose scale is known: c > 0, pixels.
struct ScaledLoss {
  LossKind kind = LossKind::none;
  double scale_px = 1;
  /// Of the curvature along a residual, as a part of its weight: what steps see of it is not below
  /// (geometry/row_metric.h). 1: the weight alone. Costs do not depend on it.
  double floor = 1;
  /// Rows count by sigmas, or points have rows of their own: passes weigh them though there may be
  /// no loss.
  bool weighted = false;

  bool weighs() const { return kind != LossKind::none || weighted; }
  friend bool operator==(const ScaledLoss&, const ScaledLoss&) = default;
};

/// rho at s = |r|^2 (px^2), and its derivatives by s.
template <class Scalar>
struct LossValue {
  Scalar value, first, second;
};

/// With z = s / c^2 >= 0; all have rho(0) = 0, rho'(0) = 1, and are concave:
///   none           s
///   Huber          s where z <= 1, else c^2 (2 sqrt(z) - 1)
///   soft-L1        2 c^2 (sqrt(1 + z) - 1)
///   Cauchy         c^2 log(1 + z)
///   Tukey          c^2 / 3 (1 - (1 - z)^3) where z <= 1, else c^2 / 3
///   Geman-McClure  c^2 z / (1 + z)
template <class Scalar>
LossValue<Scalar> evaluate_loss(const ScaledLoss& loss, const Scalar& s) {
  using std::log1p, std::sqrt;
  const double c2 = loss.scale_px * loss.scale_px;
  const Scalar one(1), z = s / Scalar(c2);
  switch (loss.kind) {
    case LossKind::none:
      break;
    case LossKind::huber: {
      if (!(one < z)) break;
      const Scalar root = sqrt(z), first = one / root;
      return {Scalar(c2) * (Scalar(2) * root - one), first, -first / (Scalar(2) * s)};
    }
    case LossKind::soft_l1: {
      const Scalar root = sqrt(one + z), first = one / root;
      // 2 c^2 (root - 1) without its cancellation near 0
      return {Scalar(2) * s / (root + one), first, -first / (Scalar(2 * c2) * (one + z))};
    }
    case LossKind::cauchy: {
      const Scalar first = one / (one + z);
      return {Scalar(c2) * log1p(z), first, -first * first / Scalar(c2)};
    }
    case LossKind::tukey: {
      if (one < z) return {Scalar(c2 / 3), Scalar(0), Scalar(0)};
      const Scalar left = one - z;
      // (1 - (1 - z)^3) / 3 = z (1 - z + z^2 / 3)
      return {s * (one - z + z * z / Scalar(3)), left * left, -Scalar(2 / c2) * left};
    }
    case LossKind::geman_mcclure: {
      const Scalar first = one / (one + z);
      return {s * first, first * first, -Scalar(2 / c2) * first * first * first};
    }
  }
  return {s, one, Scalar(0)};
}

/// The scale c / sigma at which a loss keeps 95% of the least-squares efficiency when the two
/// components of every residual are independent, normal and of one sigma (docs/math.md derives it;
/// the usual constants, 1.345 for Huber and so on, are for one component).
double tuning_constant(LossKind kind);

/// Whether rho(|r|^2) is convex in r everywhere.
bool is_convex(LossKind kind);

}  // namespace sheaf
