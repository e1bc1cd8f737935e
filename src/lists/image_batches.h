// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "platform/buffer.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Observations of points that are held, arranged for eight lanes: image by image, eight of one
/// image in a batch, each with its point beside it. Nothing then couples the images, and a pass
/// over one image's batches reads memory from front to back.
struct ImageBatches {
  /// Batches of one image that are summed together: their sums are added in order.
  struct Piece {
    std::uint64_t first_batch;
    std::uint32_t image;
    std::uint32_t batches;
    std::uint32_t last_lanes;  ///< of the last batch; lanes beyond repeat its first, masked
  };
  static constexpr std::uint32_t kBatchesPerPiece = 64;
  /// Per batch: X, Y, Z of the eight lanes, then x and y in pixels.
  static constexpr std::size_t kBatchDoubles = 40;

  std::vector<Piece> pieces;  ///< by image
  Buffer<double> rows;        ///< kBatchDoubles per batch
  std::uint64_t observations = 0;

  const double* batches(const Piece& piece) const {
    return rows.data() + kBatchDoubles * piece.first_batch;
  }
};

/// Arranges the observations of a valid problem, each image's in their order; those with skip[i]
/// != 0 are left out (skip may be empty).
ImageBatches arrange_by_image(const Problem& problem, const std::vector<std::uint8_t>& skip = {});

/// Batches that this takes, counted before anything is allocated.
std::uint64_t count_image_batches(const Problem& problem);

}  // namespace sheaf
