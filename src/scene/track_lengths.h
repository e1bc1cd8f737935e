// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace sheaf {

class Random;

/// Numbers of observations for `points` points, in random order, each in [2, longest], with the sum
/// round(mean * points). The tail is heavy, as in photo collections: 2 + X with
/// P(X >= x) = 1 / (1 + x / s)^2, cut at the longest. Needs points > 0 and 2 <= mean <= longest.
std::vector<std::uint32_t> draw_track_lengths(std::uint64_t points, double mean,
                                              std::uint32_t longest, Random& random);

}  // namespace sheaf
