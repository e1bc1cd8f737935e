// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/comparison.h"

namespace sheaf {

/// Cost against time as an SVG: cost / best - 1 over seconds, both logarithmic; a mark for each
/// step. Gaps below 1e-8 are drawn there. The first curve is on top.
std::string cost_plot(const std::string& title,
                      const std::vector<std::pair<std::string, CostTrace>>& curves, double best);

}  // namespace sheaf
