// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "lists/batches.h"
#include "lists/chunks.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "systems/quantile.h"

namespace sheaf {

/// A quantile of |r_x| and |r_y| together over all observations. residuals(chunk, out) writes |r_x|
/// of a batch's eight lanes, then |r_y|, 16 for each batch of the chunk. Counts are whole numbers:
/// the threads' shares add up to the same in any order.
template <class Residuals>
double residual_quantile(const Batches& batches, const Chunks& chunks, double quantile,
                         Threads& threads, const Residuals& residuals) {
  QuantileSearch search(quantile, 2 * batches.observations);
  std::vector<Buffer<double>> scratch(static_cast<std::size_t>(threads.count()));
  while (!search.done()) {
    std::vector<DigitCounts> counts(scratch.size());
    threads.for_each(chunks.slices.size() - 1, [&](std::size_t s) {
      const auto worker = static_cast<std::size_t>(threads.worker());
      if (scratch[worker].size() == 0) scratch[worker].allocate(16 * chunks.most_batches);
      for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c) {
        const Chunk& chunk = chunks.chunks[c];
        residuals(chunk, scratch[worker].data());
        for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
          const Batches::Group& group = batches.groups[g];
          const double* of = scratch[worker].data() + 16 * (group.first_batch - chunk.first_batch);
          for (std::uint32_t row = 0; row < 2 * group.track; ++row)
            for (std::uint32_t l = 0; l < group.lanes; ++l)
              search.count(of[8 * row + l], counts[worker]);
        }
      }
    });
    search.narrow(sum_of(counts));
  }
  return search.value();
}

}  // namespace sheaf
