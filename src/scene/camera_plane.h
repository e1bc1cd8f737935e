// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Observations whose point has no pixel up to rounding, ascending. No observation is in both.
struct PlaneSights {
  std::vector<std::uint64_t> in_plane;   ///< Z = 0 in the camera, and its view ends there
  std::vector<std::uint64_t> at_centre;  ///< the point is the camera's centre
};

/// A coordinate counts as 0 below 1e-12 of |R_k| |X| + |t_k|, the sizes that it is the difference
/// of. Lenses that see more than 180 degrees have pixels at Z = 0.
PlaneSights plane_sights(const Problem& problem);

}  // namespace sheaf
