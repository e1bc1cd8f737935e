// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "platform/buffer.h"
#include "sheaf/problem.h"

namespace sheaf {

class Threads;

/// Observations listed by point, each point's by image.
struct ByPoint {
  Buffer<std::uint64_t> first;  ///< points + 1
  Buffer<std::uint64_t> observation;
  bool identity = false;  ///< the file's order is this order already; `observation` is then empty
  std::uint64_t at(std::uint64_t i) const { return identity ? i : observation[i]; }
  std::uint64_t track(std::size_t point) const { return first[point + 1] - first[point]; }
};

/// Two counting sorts: by image, then stably by point. skip: 1 for each observation to leave out,
/// or empty.
ByPoint list_by_point(const Problem& problem, const std::vector<std::uint8_t>& skip,
                      Threads& threads);

}  // namespace sheaf
