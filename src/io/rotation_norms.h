// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Rotations that a file stated by quaternions or matrices whose lengths are not 1, by more than
/// digits explain (1e-4). Here they are normalised; programs that take them as they are, COLMAP
/// among them, find other residuals.
struct OffNorms {
  std::vector<std::uint64_t> images;  ///< whose own rotation, or that of frame or sensor, is such
  double largest = 0;                 ///< |length - 1| of the worst
};
OffNorms off_norms(const Problem& problem);

}  // namespace sheaf
