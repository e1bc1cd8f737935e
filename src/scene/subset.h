// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Leaves out the observations that are not `kept`, then points with fewer than `least_track`
/// observations left, together with these and the terms that name them; `kept` is then what is
/// left. Images, lenses, rigs and features stay. Returns the number of each point among those left,
/// or kGonePoint.
inline constexpr std::uint32_t kGonePoint = UINT32_MAX;
std::vector<std::uint32_t> keep_observations(Problem& problem, std::vector<bool>& kept,
                                             std::uint32_t least_track);

}  // namespace sheaf
