// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// r of each observation, modelled less measured: x and y in turn, px; may be infinite or NaN. The
/// bits do not depend on the number of threads (0: all).
std::vector<double> residuals(const Problem& problem, int threads = 1);

/// |r| of each observation, px; may be infinite or NaN. Threads as above.
std::vector<double> residual_lengths(const Problem& problem, int threads = 1);

/// Mean |r| of each point's observations, px, as COLMAP states it for points; 0 for a point without
/// observations, and -1 (not known) where it is not finite.
std::vector<double> mean_point_errors(const Problem& problem);

}  // namespace sheaf
