// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "sheaf/covariance.h"

namespace sheaf {

/// Limits of docs/covariance.md: beyond them a parameter counts as not determined.
inline constexpr double kWeakFocal = 0.1, kWeakCentre_px = 100, kWeakCorner_px = 10,
                        kWeakCorrelation = 0.999;

/// Parameters of lenses that are not determined, and pairs that cannot be told apart; lenses: as
/// Covariance has them.
std::vector<WeakDirection> weak_directions(const Problem& problem,
                                           const std::vector<std::vector<double>>& lenses);

}  // namespace sheaf
