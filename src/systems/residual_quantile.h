// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "lists/chunks.h"
#include "lists/slices.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "systems/quantile.h"

namespace sheaf {

/// What is worked in, one of each for a thread; kept, so that the next time allocates nothing.
struct ResidualScratch {
  std::vector<Buffer<double>> residuals;
  std::vector<DigitCounts> counts;
  DigitCounts sum;

  void allocate(std::size_t threads, std::size_t doubles) {
    residuals.resize(threads), counts.resize(threads);
    for (Buffer<double>& of_thread : residuals)
      if (of_thread.size() == 0) of_thread.allocate(doubles);
  }
};

/// Observations whose sigma is infinite: they take no part.
inline std::uint64_t count_switched_off(const Batches& batches) {
  if (batches.inverse_sigma.size() == 0) return 0;
  std::uint64_t off = 0;
  for (const Batches::Group& group : batches.groups)
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l) off += batches.inverse_sigma[8 * b + l] == 0;
  return off;
}

/// A quantile of |r_x| and |r_y| together over all observations that are not switched off.
/// residuals(chunk, out) writes |r_x| of a batch's eight lanes, then |r_y|, 16 for each batch of
/// the chunk. Counts are whole numbers: the threads' shares add up to the same in any order.
template <class Residuals>
double residual_quantile(const Batches& batches, const Chunks& chunks, double quantile,
                         Threads& threads, ResidualScratch& scratch, const Residuals& residuals) {
  QuantileSearch search(quantile, 2 * (batches.observations - count_switched_off(batches)));
  scratch.allocate(static_cast<std::size_t>(threads.count()), 16 * chunks.most_batches);
  const bool sigmas = batches.inverse_sigma.size() > 0;
  while (!search.done()) {
    for (DigitCounts& counts : scratch.counts) QuantileSearch::clear(counts);
    threads.for_each(chunks.slices.size() - 1, [&](std::size_t s) {
      const auto worker = static_cast<std::size_t>(threads.worker());
      double* const room = scratch.residuals[worker].data();
      for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c) {
        const Chunk& chunk = chunks.chunks[c];
        residuals(chunk, room);
        for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
          const Batches::Group& group = batches.groups[g];
          const double* of = room + 16 * (group.first_batch - chunk.first_batch);
          for (std::uint32_t row = 0; row < 2 * group.track; ++row)
            for (std::uint32_t l = 0; l < group.lanes; ++l)
              if (!sigmas || batches.inverse_sigma[8 * (group.first_batch + row / 2) + l] != 0)
                search.count(of[8 * row + l], scratch.counts[worker]);
        }
      }
    });
    sum_of(scratch.counts, scratch.sum);
    search.narrow(scratch.sum);
  }
  return search.value();
}

/// The root of the mean |r|^2 of the same observations in pixels, whatever their sigmas.
template <class Residuals>
double pixel_rms(const Batches& batches, const Chunks& chunks, Threads& threads,
                 ResidualScratch& scratch, const Residuals& residuals) {
  scratch.allocate(static_cast<std::size_t>(threads.count()), 16 * chunks.most_batches);
  const bool sigmas = batches.inverse_sigma.size() > 0;
  std::array<double, kMostSlices> sums{};
  threads.for_each(chunks.slices.size() - 1, [&](std::size_t s) {
    double* const room = scratch.residuals[static_cast<std::size_t>(threads.worker())].data();
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c) {
      const Chunk& chunk = chunks.chunks[c];
      residuals(chunk, room);
      for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
        const Batches::Group& group = batches.groups[g];
        for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
          for (std::uint32_t l = 0; l < group.lanes; ++l) {
            const double by = sigmas ? batches.inverse_sigma[8 * b + l] : 1;
            if (by == 0) continue;  // switched off
            const double* r = room + 16 * (b - chunk.first_batch) + l;
            sums[s] += (r[0] * r[0] + r[8] * r[8]) / (by * by);
          }
      }
    }
  });
  double sum = 0;
  for (const double of_slice : sums) sum += of_slice;
  const std::uint64_t count = batches.observations - count_switched_off(batches);
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

}  // namespace sheaf
