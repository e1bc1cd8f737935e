// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Camera centres on the plane in which they vary most, in [0, 1]^2 with one scale for both axes.
/// The few that lie far off (beyond the middle 98% by a fifth of its width) are put on the edge and
/// counted.
struct NetworkView {
  std::vector<std::array<double, 2>> places;
  std::size_t beyond = 0;
  double aspect = 1;  ///< width of the second axis over that of the first
};
NetworkView widest_view(const Problem& problem);

}  // namespace sheaf
