// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "platform/buffer.h"

namespace sheaf {

class Threads;

/// Consecutive groups whose elimination records (T and C, 384 bytes per observation) stay in the
/// second-level cache between the pass that writes them and the passes that multiply them.
struct Chunk {
  std::uint32_t first_group, end_group;
  std::uint64_t first_batch, end_batch;
  std::uint64_t first_pair_run, end_pair_run;
  std::uint64_t first_diagonal_run, end_diagonal_run;
};

/// Pairs of records (local to the chunk: 8 x batch + lane) of one pair of images.
struct RecordPair {
  std::uint16_t a, b;
};
struct PairRun {
  std::uint32_t tile;
  std::uint32_t count;
  std::uint64_t first;
};
struct DiagonalRun {
  std::uint32_t image;
  std::uint32_t count;
  std::uint64_t first;
};

/// The off-diagonal block of images row >= column of the reduced camera matrix. row == column
/// happens where one image observes a point twice.
struct Tile {
  std::uint32_t row, column;
};

/// What is summed where: built once, a pure function of the problem.
struct Chunks {
  static constexpr std::uint64_t kBatchesPerChunk = 128;
  /// Local record numbers have 16 bits.
  static constexpr std::uint32_t kLongestTrack = 8191;

  std::vector<Chunk> chunks;
  std::vector<Tile> tiles;
  Buffer<PairRun> pair_runs;
  Buffer<RecordPair> pairs;
  Buffer<DiagonalRun> diagonal_runs;
  Buffer<std::uint16_t> diagonal;  ///< local record numbers
  std::uint64_t most_batches = 0;  ///< in any chunk

  /// Chunks slices[s] to slices[s + 1] add into one set of sums, in order; the sets are then added
  /// in order. The cut depends on the work in the chunks only, never on the number of threads.
  std::vector<std::uint32_t> slices;
};

/// What a chunk lists of its records.
enum class ChunkLists {
  none,      ///< nothing: sums run over the records in their own order
  diagonal,  ///< records by image
  pairs,     ///< records by image, and pairs by tile; needs longest_track <= kLongestTrack
};
Chunks cut_into_chunks(const Batches& batches, std::uint32_t num_images, ChunkLists lists,
                       Threads& threads, std::uint64_t most_batches = Chunks::kBatchesPerChunk);
Chunks cut_into_chunks(const Batches& batches, std::uint32_t num_images, ChunkLists lists,
                       std::uint64_t most_batches = Chunks::kBatchesPerChunk);

}  // namespace sheaf
