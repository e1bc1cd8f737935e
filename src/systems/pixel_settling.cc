// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Points of patches under a loss: they go back where a step made them worse, and damp themselves.
// docs/math.md, section 12, has the rule. What patches cost that leave their image.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "systems/pixel_rows.h"

namespace sheaf {

bool PixelRows::take_leaving(const std::vector<double>& costs) {
  if (costs.size() != leaving_.size()) return false;
  std::copy(costs.begin(), costs.end(), leaving_.data());
  return left_before_ = true;
}

/// A patch that leaves costs as much as it does now, and no less than the mean does.
void PixelRows::set_leaving() {
  double sum[2] = {0, 0};
  std::uint64_t count = 0;
  const auto for_each_patch = [&](const auto& visit) {
    for (const Batches::Group& group : batches_.groups)
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        for (std::uint32_t l = 0; l < group.lanes; ++l) visit(16 * b + l);
  };
  for_each_patch([&](std::uint64_t at) {
    if (std::isnan(held_.seen[at])) return;
    sum[0] += held_.costs[at], sum[1] += held_.costs[at + 8];
    ++count;
  });
  if (count == 0) return;
  for_each_patch([&](std::uint64_t at) {
    for (int k = 0; k < 2; ++k)
      leaving_[at + 8 * k] = std::max(held_.costs[at + 8 * k], sum[k] / static_cast<double>(count));
  });
}

/// Points whose patches and measurements rose by more than half of what their step promised go back
/// to where they were, and damp themselves by more in the elimination to come; others by less.
bool PixelRows::send_back(const Chunk& chunk, double lambda, Settling& points) const {
  constexpr double kShare = 0.5;
  bool any = false;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches_.groups[g];
    for (std::uint32_t l = 0; l < group.lanes; ++l) {
      const std::uint64_t lane = 8 * std::uint64_t(g) + l;
      const std::uint64_t at = mixed_ ? mixed_->place_of(batches_.lane_point[lane]) : lane;
      double rise = mixed_ ? tried_.measured_costs[at] - held_.measured_costs[at] : 0;
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        rise += tried_.costs[16 * b + l] - held_.costs[16 * b + l];
      double promise = 0;
      for (int i = 0; i < 3; ++i) {
        const double w =
            state_->factors[kFactorGroup * (at / 8) + std::size_t(factor_group::w(i)) + at % 8];
        promise += w * w;
      }
      double& own = points.own_damping[at];
      const bool fell = !(rise <= kShare * promise);
      own = inner_iterations::next_own_damping(fell, lambda, own);
      if (!fell) continue;
      any = true;
      points.left_decrease += promise;
      for (std::size_t i = 0; i < kPointGroup; i += 8) {
        const std::size_t x = kPointGroup * (at / 8) + i + at % 8;
        points.tried[x] = state_->held.points[x];
      }
    }
  }
  return any;
}

void PixelRows::settle(double lambda, Settling& points) {
  const Chunks& chunks = patch_chunks();
  std::vector<Settling> of_chunk(chunks.chunks.size(), points);
  std::vector<std::uint8_t> any(of_chunk.size());
  threads_.for_each(of_chunk.size(), [&](std::size_t c) {
    of_chunk[c].left_decrease = 0;
    any[c] = send_back(chunks.chunks[c], lambda, of_chunk[c]);
  });
  for (const Settling& of : of_chunk) points.left_decrease += of.left_decrease;
  if (std::find(any.begin(), any.end(), 1) != any.end())
    tried_totals_ = collapse(state_->tried, tried_);
}

}  // namespace sheaf
