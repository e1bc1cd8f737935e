// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/slices.h"

#include <algorithm>

#include "lists/block_layout.h"

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

int count_slices(double flops, std::uint64_t tiles, std::uint64_t images) {
  constexpr double kFlopsPerSlice = 15e6, kBytes = 96e6;
  const double sums = 8.0 * (kTileDoubles * static_cast<double>(tiles) +
                             kDiagonalDoubles * static_cast<double>(images));
  // Sums that stay in the second-level cache cost next to nothing: small scenes have slices too, so
  // that several threads are of use to them.
  constexpr double kFewFlops = 3e6, kCheapBytes = 128e3, kMostFew = 8;
  const double few = sums < kCheapBytes ? std::min(kMostFew, flops / kFewFlops) : 0;
  return std::max(
      1, static_cast<int>(std::min(
             {double(kMostSlices), std::max(few, flops / kFlopsPerSlice), kBytes / sums})));
}

}  // namespace sheaf
