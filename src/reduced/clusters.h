// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "lists/columns.h"
#include "platform/parallel.h"

namespace sheaf {

/// Which images see points in common, and how many: counted over a sample of the points and of the
/// pairs of their tracks, some kPairsPerImage for each image and kMostPairs in all.
class Covisibility {
 public:
  struct Neighbour {
    std::uint32_t image, weight;
  };
  Covisibility(const Batches& batches, std::size_t images, Threads& threads);
  /// Of what the images hang on: number[i] of each image i, at most `count`.
  Covisibility(const Batches& batches, const std::vector<std::uint32_t>& number, std::size_t count,
               Threads& threads);

  const Neighbour* begin(std::size_t image) const { return &neighbours_[first_[image]]; }
  const Neighbour* end(std::size_t image) const { return &neighbours_[first_[image + 1]]; }

 private:
  static constexpr std::uint64_t kPairsPerImage = 512, kMostPairs = 4000000;
  template <class Number>
  void count(const Batches& batches, std::size_t images, const Number& number, Threads& threads);
  void merge(std::vector<std::uint32_t>& others, Threads& threads);

  std::vector<std::uint64_t> first_;
  std::vector<Neighbour> neighbours_;  ///< of each image, ascending
};

/// Images whose poses are free, in groups that see much in common.
struct Clusters {
  static constexpr std::int32_t kNone = -1;
  std::vector<std::int32_t> of_image;  ///< kNone where the pose is held
  std::int32_t count = 0;
  std::vector<std::int32_t> pairs{};  ///< number_cluster_pairs, where they have been numbered
  /// Of each image of the rows, where these hang on other blocks; empty: as of_image.
  std::vector<std::int32_t> of_row_image{};

  const std::vector<std::int32_t>& of_rows() const {
    return of_row_image.empty() ? of_image : of_row_image;
  }
};

/// Numbers the pairs of clusters (row >= column, by triangle) that see a point in common, and all
/// clusters with themselves; -1: none. Looks at every `stride`th group.
std::vector<std::int32_t> number_cluster_pairs(const Batches& batches, const Clusters& clusters,
                                               Threads& threads, std::size_t stride = 1);

std::uint64_t count_cluster_pairs(const std::vector<std::int32_t>& numbers);

/// Where the pair row >= column stands in a triangle.
inline std::size_t cluster_pair(std::int32_t row, std::int32_t column) {
  return static_cast<std::size_t>(row) * (static_cast<std::size_t>(row) + 1) / 2 +
         static_cast<std::size_t>(column);
}

/// Grown one image at a time by what an image sees in common with the cluster so far, up to
/// `images_each`; remnants much smaller than that join the neighbour they share most with.
/// A pure function of its arguments.
Clusters cluster_images(const Covisibility& graph, const Columns& columns, std::size_t images_each);

}  // namespace sheaf
