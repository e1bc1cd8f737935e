// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/track_lengths.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "platform/random.h"

namespace sheaf {
namespace {

// Mean of the whole part of X cut at `most`: sum over x = 1 ... most of P(X >= x).
double mean_above_two(double s, std::uint32_t most) {
  double sum = 0;
  for (std::uint32_t x = 1; x <= most; ++x) {
    const double k = 1 + x / s;
    sum += 1 / (k * k);
  }
  return sum;
}

double scale_for_mean(double mean, std::uint32_t most) {
  if (mean <= 0) return 0;
  double low = 0, high = 1;
  while (high < 1e15 && mean_above_two(high, most) < mean) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (mean_above_two(middle, most) < mean ? low : high) = middle;
  }
  return high;
}

// Stratified draws miss the sum by little; the rest is spread one by one.
void settle_sum(std::vector<std::uint32_t>& lengths, std::uint64_t target, std::uint32_t longest) {
  std::uint64_t sum = 0;
  for (const std::uint32_t length : lengths) sum += length;
  while (sum != target) {
    for (std::uint32_t& length : lengths) {
      if (sum < target && length < longest) ++length, ++sum;
      if (sum > target && length > 2) --length, --sum;
      if (sum == target) return;
    }
  }
}

}  // namespace

std::vector<std::uint32_t> draw_track_lengths(std::uint64_t points, double mean,
                                              std::uint32_t longest, Random& random) {
  const std::uint32_t most = longest - 2;
  const double s = scale_for_mean(mean - 2, most);
  std::vector<std::uint32_t> lengths(points);
  for (std::uint64_t i = 0; i < points; ++i) {
    const double u = (static_cast<double>(i) + random.uniform()) / static_cast<double>(points);
    const double x = s > 0 ? s * (1 / std::sqrt(std::max(u, 1e-30)) - 1) : 0;
    lengths[i] = 2 + static_cast<std::uint32_t>(std::min(x, static_cast<double>(most)));
  }
  for (std::uint64_t i = points; i > 1; --i) std::swap(lengths[i - 1], lengths[random.below(i)]);
  const auto target = static_cast<std::uint64_t>(mean * static_cast<double>(points) + 0.5);
  settle_sum(lengths, std::min(target, points * longest), longest);
  return lengths;
}

}  // namespace sheaf
