// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/lent_observations.h"

#include <atomic>
#include <new>
#include <vector>

#include "platform/buffer.h"
#include "platform/parallel.h"

namespace sheaf {
namespace {

constexpr std::size_t kObservations = 65536, kGroups = 1024;

/// An empty vector that holds no memory.
template <class T>
void release(std::vector<T>& v) {
  std::vector<T>().swap(v);
}

void clear(Problem& problem, bool with_xy) {
  release(problem.observation_image);
  release(problem.observation_point);
  if (with_xy) release(problem.observation_xy);
}

}  // namespace

bool LentObservations::possible(const Problem& p, const Batches& batches, Threads& threads) {
  if (batches.observations != p.num_observations()) return false;
  std::atomic<bool> sorted{true};
  threads.for_ranges(p.num_observations(), kObservations, [&](std::size_t i, std::size_t end) {
    for (i = i == 0 ? 1 : i; i < end; ++i) {
      const std::uint32_t a = p.observation_point[i - 1], b = p.observation_point[i];
      if (a > b || (a == b && p.observation_image[i - 1] > p.observation_image[i]))
        return sorted.store(false, std::memory_order_relaxed);
    }
  });
  return sorted;
}

std::uint64_t LentObservations::bytes(const Problem& problem, bool with_xy) {
  return problem.num_observations() *
         (2 * sizeof(std::uint32_t) + (with_xy ? 2 * sizeof(double) : 0));
}

LentObservations::LentObservations(Problem& problem, const Batches& batches, Threads& threads,
                                   bool with_xy)
    : problem_(problem), batches_(batches), threads_(threads), with_xy_(with_xy) {
  clear(problem, with_xy);
}

LentObservations::~LentObservations() {
  try {
    put_back();
  } catch (const std::bad_alloc&) {
    clear(problem_, true);
  }
}

void LentObservations::put_back() {
  // Where each point's observations begin: after those of the points before it.
  Buffer<std::uint64_t> first(problem_.num_points() + 1);
  first.fill(0);
  for (std::size_t g = 0; g < batches_.groups.size(); ++g)
    for (std::uint32_t l = 0; l < batches_.groups[g].lanes; ++l)
      first[batches_.lane_point[8 * g + l] + std::size_t(1)] = batches_.groups[g].track;
  for (std::size_t j = 0; j < problem_.num_points(); ++j) first[j + 1] += first[j];
  problem_.observation_image.resize(batches_.observations);
  problem_.observation_point.resize(batches_.observations);
  if (with_xy_) problem_.observation_xy.resize(2 * batches_.observations);
  threads_.for_ranges(batches_.groups.size(), kGroups, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g) {
      const Batches::Group& group = batches_.groups[g];
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        const std::uint32_t point = batches_.lane_point[8 * g + l];
        for (std::uint32_t o = 0; o < group.track; ++o) {
          const std::uint64_t i = first[point] + o, b = group.first_batch + o;
          problem_.observation_image[i] = batches_.image[8 * b + l];
          problem_.observation_point[i] = point;
          if (!with_xy_) continue;
          problem_.observation_xy[2 * i] = batches_.xy[16 * b + l];
          problem_.observation_xy[2 * i + 1] = batches_.xy[16 * b + 8 + l];
        }
      }
    }
  });
}

}  // namespace sheaf
