// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/slices.h"

#include <algorithm>

namespace sheaf {

void add_slices(Buffer<double>& sums, std::size_t slices, Threads& threads) {
  constexpr std::size_t kBlock = 16384;
  const std::size_t size = sums.size() / slices;
  threads.for_each((size + kBlock - 1) / kBlock, [&](std::size_t b) {
    const std::size_t first = b * kBlock, end = std::min(size, first + kBlock);
    for (std::size_t s = 1; s < slices; ++s)
      for (std::size_t i = first; i < end; ++i) sums[i] += sums[s * size + i];
  });
}

}  // namespace sheaf
