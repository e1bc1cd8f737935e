// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Observations by point: those of point p are order[begin[p]] ... order[begin[p + 1] - 1], images
/// ascending, those of one image ascending.
struct Tracks {
  std::vector<std::uint64_t> begin, order;
};
Tracks tracks_of(const Problem& problem);

/// Calls link(a, b, points) once for each pair of images a < b that see points in common,
/// ascending. Exact; work is the number of pairs of observations of one point, memory linear
/// (up to 1024 images 4 MB more).
void for_each_link(const Problem& problem, const Tracks& tracks,
                   const std::function<void(std::uint32_t, std::uint32_t, std::uint32_t)>& link);

}  // namespace sheaf
