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

namespace {

/// Slices of a scene whose sums stay in the second-level cache, where they cost next to nothing: so
/// that several threads are of use to it too.
double few_slices(double flops, double sum_bytes) {
  constexpr double kFewFlops = 3e6, kCheapBytes = 128e3, kMostFew = 8;
  return sum_bytes < kCheapBytes ? std::min(kMostFew, flops / kFewFlops) : 0;
}

double bytes_of_sums(std::uint64_t tiles, std::uint64_t images) {
  return 8.0 * (kTileDoubles * static_cast<double>(tiles) +
                kDiagonalDoubles * static_cast<double>(images));
}

constexpr double kFlopsPerSlice = 15e6;

}  // namespace

int count_slices(double flops, std::uint64_t tiles, std::uint64_t images) {
  constexpr double kBytes = 96e6;
  const double sums = bytes_of_sums(tiles, images);
  const double slices = std::max(few_slices(flops, sums), flops / kFlopsPerSlice);
  return std::max(1, static_cast<int>(std::min({double(kMostSlices), slices, kBytes / sums})));
}

bool is_small(double flops, std::uint64_t tiles, std::uint64_t images) {
  return few_slices(flops, bytes_of_sums(tiles, images)) > flops / kFlopsPerSlice;
}

}  // namespace sheaf
