// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/refill.h"

#include "lists/by_point.h"
#include "platform/parallel.h"

namespace sheaf {
namespace {

constexpr std::size_t kBatches = 1024, kGroups = 256;

}  // namespace

Refill::Refill(const Problem& problem, const std::vector<std::uint8_t>& skip,
               const Batches& batches, Threads& threads)
    : observation_(8 * batches.num_batches()) {
  const ByPoint by_point = list_by_point(problem, skip, threads);
  threads.for_ranges(batches.groups.size(), kGroups, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g) {
      const Batches::Group& group = batches.groups[g];
      for (std::size_t l = 0; l < 8; ++l) {
        const std::uint64_t begin = by_point.first[batches.lane_point[8 * g + l]];
        for (std::uint32_t o = 0; o < group.track; ++o)
          observation_[8 * (group.first_batch + o) + l] = by_point.at(begin + o);
      }
    }
  });
}

void Refill::fill(const Problem& problem, Threads& threads, Batches& batches) const {
  const bool sigmas = batches.inverse_sigma.size() > 0;
  threads.for_ranges(batches.num_batches(), kBatches, [&](std::size_t b, std::size_t end) {
    for (; b < end; ++b)
      for (std::size_t l = 0; l < 8; ++l) {
        const std::uint64_t i = observation_[8 * b + l];
        batches.xy[16 * b + l] = problem.observation_xy[2 * i];
        batches.xy[16 * b + 8 + l] = problem.observation_xy[2 * i + 1];
        if (sigmas) batches.inverse_sigma[8 * b + l] = 1 / problem.observation_sigma[i];
      }
  });
}

}  // namespace sheaf
