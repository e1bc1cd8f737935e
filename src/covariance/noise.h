// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "covariance/normal_equations.h"
#include "geometry/loss.h"

namespace sheaf {

/// E over normal residuals of two components and the sigma given: of w, of the score's mean
/// derivative w + s rho'', and of w^2 s / 2 by sigma^2; of the squares of the first two.
struct LossMoments {
  double weight = 1, slope = 1, square = 1;
  double weight_square = 1;
  double slope_square = 1;  ///< half the trace of the square of the score's derivative
};
LossMoments normal_moments(const ScaledLoss& loss, double sigma);

/// sigma^2 factor (J^T W J)^-1 is the covariance.
struct Noise {
  double sigma = 1, factor = 1;
  bool estimated = false;
  double redundancy = 0;
};
/// stated: a sigma, or 0. unknowns less what the gauge holds; rows of everything.
Noise noise_of(const ResidualMoments& moments, const ScaledLoss& loss, double stated,
               double unknowns);

}  // namespace sheaf
