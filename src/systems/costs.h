// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "geometry/loss.h"

namespace sheaf {

/// Of a state: twice its cost without and with the loss and what there is beside observations; px^2
/// or, with sigmas, a number.
struct Costs {
  double square = 0, robust = 0;

  /// From sums over the observations. A loss may be finite where the residual is not: such a state
  /// has no finite cost either. Without a loss loss_sum is not looked at.
  static Costs of(const ScaledLoss& loss, double square_sum, double loss_sum) {
    const bool plain = !loss.weighs() || !std::isfinite(square_sum);
    return {square_sum, plain ? square_sum : loss_sum};
  }
  bool finite() const { return std::isfinite(square) && std::isfinite(robust); }
};

}  // namespace sheaf
