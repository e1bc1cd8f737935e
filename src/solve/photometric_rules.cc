// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/photometric_rules.h"

#include <cmath>

namespace sheaf {
namespace {

/// The usual constants keep 95% of the least-squares efficiency on one component.
double pixel_tuning_constant(LossKind kind) {
  switch (kind) {
    case LossKind::none:
      break;
    case LossKind::huber:
      return 1.345;
    case LossKind::soft_l1:
      return 1.174;
    case LossKind::cauchy:
      return 2.385;
    case LossKind::tukey:
      return 4.685;
    case LossKind::geman_mcclure:
      return 3.648;
  }
  return 1;
}

}  // namespace

ScaledLoss scaled_for(const PhotometricOptions& options, const Pattern& pattern, double sigma) {
  ScaledLoss loss{options.loss.kind, options.loss.scale_px};
  if (loss.kind == LossKind::none || loss.scale_px != kAutomaticScale) return loss;
  const double pixels = options.loss_per_patch ? std::sqrt(static_cast<double>(pattern.size())) : 1;
  loss.scale_px = pixel_tuning_constant(loss.kind) * sigma * pixels;
  return loss;
}

}  // namespace sheaf
