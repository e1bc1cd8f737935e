// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/by_point.h"

#include <algorithm>
#include <atomic>

#include "platform/parallel.h"

namespace sheaf {
namespace {

/// Parts of a pass over observations that one thread takes at a time.
constexpr std::size_t kObservations = 16384;

bool sorted_by_point_and_image(const Problem& p, Threads& threads) {
  std::atomic<bool> sorted{true};
  threads.for_ranges(p.num_observations(), kObservations, [&](std::size_t i, std::size_t end) {
    const std::uint32_t *point = p.observation_point.data(), *image = p.observation_image.data();
    bool here = true;  // without branches: eight observations at a time
    for (i = std::max<std::size_t>(i, 1); i < end; ++i)
      here &= (point[i - 1] < point[i]) | ((point[i - 1] == point[i]) & (image[i - 1] <= image[i]));
    if (!here) sorted.store(false, std::memory_order_relaxed);
  });
  return sorted;
}

/// Where each point's observations begin, if they are sorted.
void find_points(const Problem& p, Buffer<std::uint64_t>& first, Threads& threads) {
  const std::size_t count = p.num_observations(), points = p.num_points();
  threads.for_ranges(count, kObservations, [&](std::size_t i, std::size_t end) {
    for (; i < end; ++i) {
      const std::size_t from = i == 0 ? 0 : p.observation_point[i - 1] + std::size_t(1);
      for (std::size_t j = from; j <= p.observation_point[i]; ++j) first[j] = i;
    }
  });
  const std::size_t last = count == 0 ? 0 : p.observation_point[count - 1] + std::size_t(1);
  for (std::size_t j = last; j <= points; ++j) first[j] = count;
}

}  // namespace

ByPoint list_by_point(const Problem& p, const std::vector<std::uint8_t>& skip, Threads& threads) {
  const auto used = [&](std::size_t i) { return skip.empty() || skip[i] == 0; };
  ByPoint out;
  out.first.allocate(p.num_points() + 1);
  if (skip.empty() && sorted_by_point_and_image(p, threads)) {
    find_points(p, out.first, threads);
    out.identity = true;
    return out;
  }
  out.first.fill(0);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) ++out.first[p.observation_point[i] + 1];
  for (std::size_t i = 0; i < p.num_points(); ++i) out.first[i + 1] += out.first[i];
  std::vector<std::uint64_t> next(p.num_images() + 1, 0);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) ++next[p.observation_image[i] + 1];
  for (std::size_t i = 0; i < p.num_images(); ++i) next[i + 1] += next[i];
  const std::uint64_t count = out.first[p.num_points()];
  Buffer<std::uint64_t> by_image(count);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) by_image[next[p.observation_image[i]]++] = i;
  std::vector<std::uint64_t> place(out.first.begin(), out.first.end() - 1);
  out.observation.allocate(count);
  for (std::uint64_t i : by_image) out.observation[place[p.observation_point[i]]++] = i;
  return out;
}

}  // namespace sheaf
