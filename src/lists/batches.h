// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "platform/buffer.h"
#include "sheaf/problem.h"

namespace sheaf {

class Threads;

/// A point's own rows, U (X - mean), 8 lanes each: U by rows of its upper triangle, then the mean.
/// U is 0 of points that have none, and in masked lanes.
constexpr std::size_t kPointPrior = 72;
namespace point_prior {
constexpr int kRoot = 0, kMean = 48;
constexpr int root(int i) { return kRoot + 8 * i; }  ///< u00, u01, u02, u11, u12, u22
constexpr int mean(int i) { return kMean + 8 * i; }
}  // namespace point_prior

/// Observations arranged for eight lanes. Points are sorted by track length and then by the images
/// that see them; a group is eight points of one track length; a batch is one observation of each
/// of its eight points. So sums over a point's track need no scatter, and most batches see one
/// image in all lanes.
struct Batches {
  struct Group {
    std::uint64_t first_batch;  ///< its `track` batches follow each other
    std::uint32_t track;        ///< observations of each of its points
    std::uint32_t lanes;        ///< points in it; lanes beyond repeat the first and are masked
  };
  std::vector<Group> groups;
  std::vector<std::uint32_t> lane_point;  ///< 8 per group: point index in the problem
  Buffer<std::uint32_t> image;            ///< 8 per batch: image index
  Buffer<std::int32_t> uniform;           ///< per batch: the image all lanes share, or -1
  Buffer<double> xy;                      ///< 16 per batch: x of the lanes, then y, pixels
  Buffer<double> inverse_sigma;           ///< 8 per batch, 1 / pixels; empty: 1
  Buffer<double> prior;  ///< kPointPrior per group; empty: no point has rows of its own
  std::uint32_t longest_track = 0;
  std::uint64_t observations = 0;

  std::uint64_t num_batches() const { return uniform.size(); }
  /// Whether passes weigh the rows, be there a loss or none.
  bool weighted() const { return inverse_sigma.size() > 0 || prior.size() > 0; }
};

/// Arranges the observations of a valid problem; those with skip[i] != 0 are left out (skip may be
/// empty). Points that nobody sees are in no group.
Batches arrange(const Problem& problem, const std::vector<std::uint8_t>& skip, Threads& threads);
Batches arrange(const Problem& problem, const std::vector<std::uint8_t>& skip = {});

/// Calls visit(images) with the images of a point's track, in order, for every point of the groups
/// [first_group, end_group) whose images are not those of the point before: points are sorted by
/// them, so few sets come twice.
template <class Visit>
void for_each_image_set(const Batches& batches, std::size_t first_group, std::size_t end_group,
                        const Visit& visit) {
  std::vector<std::uint32_t> previous, set;
  for (std::size_t g = first_group; g < end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    const std::uint64_t end = group.first_batch + group.track;
    bool uniform = true;
    for (std::uint64_t b = group.first_batch; b < end; ++b) uniform &= batches.uniform[b] >= 0;
    for (std::uint32_t l = 0; l < (uniform ? 1 : group.lanes); ++l) {
      set.clear();
      for (std::uint64_t b = group.first_batch; b < end; ++b)
        set.push_back(batches.image[8 * b + l]);
      if (set == previous) continue;
      visit(set);
      previous.swap(set);
    }
  }
}

}  // namespace sheaf
