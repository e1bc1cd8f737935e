// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/image_batches.h"

#include <algorithm>

namespace sheaf {
namespace {

std::vector<std::uint64_t> count_by_image(const Problem& problem,
                                          const std::vector<std::uint8_t>& skip) {
  std::vector<std::uint64_t> counts(problem.num_images(), 0);
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (skip.empty() || skip[i] == 0) ++counts[problem.observation_image[i]];
  return counts;
}

void add_pieces(std::uint32_t image, std::uint64_t count, std::uint64_t first_batch,
                std::vector<ImageBatches::Piece>& pieces) {
  constexpr std::uint64_t kMost = 8 * ImageBatches::kBatchesPerPiece;
  for (std::uint64_t at = 0; at < count; at += kMost) {
    const std::uint64_t here = std::min(kMost, count - at);
    pieces.push_back({first_batch + at / 8, image, static_cast<std::uint32_t>((here + 7) / 8),
                      static_cast<std::uint32_t>((here + 7) % 8 + 1)});
  }
}

}  // namespace

ImageBatches arrange_by_image(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  ImageBatches out;
  const std::vector<std::uint64_t> counts = count_by_image(problem, skip);
  std::vector<std::uint64_t> next(counts.size());  // place of each image's next observation
  std::uint64_t batches = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    next[i] = 8 * batches;
    add_pieces(static_cast<std::uint32_t>(i), counts[i], batches, out.pieces);
    batches += (counts[i] + 7) / 8;
    out.observations += counts[i];
  }
  out.rows.allocate(ImageBatches::kBatchDoubles * batches);
  const auto row_at = [&](std::uint64_t place) {
    return out.rows.data() + ImageBatches::kBatchDoubles * (place / 8) + place % 8;
  };
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    if (!skip.empty() && skip[i] != 0) continue;
    double* row = row_at(next[problem.observation_image[i]]++);
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    for (int d = 0; d < 3; ++d) row[8 * d] = X[d];
    for (int d = 0; d < 2; ++d) row[24 + 8 * d] = problem.observation_xy[2 * i + d];
  }
  for (std::uint64_t end : next)
    for (std::uint64_t place = end; place % 8 != 0; ++place)
      for (int field = 0; field < 5; ++field)
        row_at(place)[8 * field] = row_at(place / 8 * 8)[8 * field];
  return out;
}

std::uint64_t count_image_batches(const Problem& problem) {
  std::uint64_t batches = 0;
  for (std::uint64_t count : count_by_image(problem, {})) batches += (count + 7) / 8;
  return batches;
}

}  // namespace sheaf
