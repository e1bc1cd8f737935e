// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/chunks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem scene(std::uint64_t images, std::uint64_t points, double mean_track) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  options.mean_track = mean_track;
  return generate(options).value().start;
}

/// A record of a chunk: which batch and lane of the whole, and what it observes.
struct Record {
  std::uint64_t batch;
  std::uint32_t lane, image, point;
};

Record record_of(const Batches& batches, const Chunk& chunk, std::uint16_t number) {
  Record r;
  r.batch = chunk.first_batch + number / 8;
  r.lane = number % 8;
  r.image = batches.image[8 * r.batch + r.lane];
  std::size_t g = chunk.first_group;
  while (batches.groups[g].first_batch + batches.groups[g].track <= r.batch) ++g;
  EXPECT_LT(g, chunk.end_group);
  EXPECT_LT(r.lane, batches.groups[g].lanes) << "a masked lane";
  r.point = batches.lane_point[8 * g + r.lane];
  return r;
}

void expect_chunks_cover(const Batches& batches, const Chunks& chunks) {
  std::uint32_t group = 0;
  std::uint64_t batch = 0, most = 0;
  for (const Chunk& chunk : chunks.chunks) {
    EXPECT_EQ(chunk.first_group, group);
    EXPECT_GT(chunk.end_group, group);
    EXPECT_EQ(chunk.first_batch, batch);
    group = chunk.end_group, batch = chunk.end_batch;
    most = std::max(most, chunk.end_batch - chunk.first_batch);
    // Cut where the cache ends, but never within a group.
    EXPECT_TRUE(chunk.end_batch - chunk.first_batch <= Chunks::kBatchesPerChunk ||
                chunk.end_group == chunk.first_group + 1);
  }
  EXPECT_EQ(group, batches.groups.size());
  EXPECT_EQ(batch, batches.num_batches());
  EXPECT_EQ(chunks.most_batches, most);
  ASSERT_GE(chunks.slices.size(), 2u);
  EXPECT_EQ(chunks.slices.front(), 0u);
  EXPECT_EQ(chunks.slices.back(), chunks.chunks.size());
  EXPECT_TRUE(std::is_sorted(chunks.slices.begin(), chunks.slices.end()));
}

void expect_every_record_once(const Batches& batches, const Chunks& chunks) {
  std::set<std::pair<std::uint64_t, std::uint32_t>> seen;
  std::uint64_t next = 0;
  for (const Chunk& chunk : chunks.chunks) {
    EXPECT_EQ(chunk.first_diagonal_run, next);
    next = chunk.end_diagonal_run;
    std::set<std::uint32_t> images;
    for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
      const DiagonalRun& run = chunks.diagonal_runs[i];
      EXPECT_TRUE(images.insert(run.image).second) << "an image in two runs of a chunk";
      for (std::uint64_t k = run.first; k < run.first + run.count; ++k) {
        const Record r = record_of(batches, chunk, chunks.diagonal[k]);
        EXPECT_EQ(r.image, run.image);
        EXPECT_TRUE(seen.emplace(r.batch, r.lane).second);
      }
    }
  }
  EXPECT_EQ(seen.size(), batches.observations);
  EXPECT_EQ(chunks.diagonal.size(), batches.observations);
}

void expect_every_pair_once(const Batches& batches, const Chunks& chunks) {
  using Place = std::pair<std::uint64_t, std::uint32_t>;
  std::set<std::pair<Place, Place>> seen;
  std::uint64_t expected = 0;
  for (const Batches::Group& g : batches.groups)
    expected += std::uint64_t(g.track) * (g.track - 1) / 2 * g.lanes;
  for (const Chunk& chunk : chunks.chunks) {
    std::set<std::uint32_t> tiles;
    for (std::uint64_t i = chunk.first_pair_run; i < chunk.end_pair_run; ++i) {
      const PairRun& run = chunks.pair_runs[i];
      ASSERT_LT(run.tile, chunks.tiles.size());
      EXPECT_TRUE(tiles.insert(run.tile).second) << "a tile in two runs of a chunk";
      EXPECT_GT(run.count, 0u);
      for (std::uint64_t k = run.first; k < run.first + run.count; ++k) {
        const Record a = record_of(batches, chunk, chunks.pairs[k].a);
        const Record b = record_of(batches, chunk, chunks.pairs[k].b);
        EXPECT_EQ(a.point, b.point);
        EXPECT_EQ(a.image, chunks.tiles[run.tile].row);
        EXPECT_EQ(b.image, chunks.tiles[run.tile].column);
        EXPECT_GT(a.batch, b.batch);
        EXPECT_TRUE(seen.emplace(Place{a.batch, a.lane}, Place{b.batch, b.lane}).second);
      }
    }
  }
  EXPECT_EQ(seen.size(), expected);
  EXPECT_EQ(chunks.pairs.size(), expected);
}

void expect_tiles_ordered(const Chunks& chunks) {
  for (std::size_t t = 0; t < chunks.tiles.size(); ++t) {
    const Tile& tile = chunks.tiles[t];
    EXPECT_GE(tile.row, tile.column);
    if (t == 0) continue;
    const Tile& before = chunks.tiles[t - 1];
    EXPECT_LT(std::tie(before.row, before.column), std::tie(tile.row, tile.column));
  }
  std::vector<bool> used(chunks.tiles.size(), false);
  for (const PairRun& run : chunks.pair_runs) used[run.tile] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0) << "a tile that nothing is added to";
}

void expect_all(const Problem& problem) {
  const Batches batches = arrange(problem);
  const auto images = static_cast<std::uint32_t>(problem.num_images());
  const Chunks chunks = cut_into_chunks(batches, images, ChunkLists::pairs);
  expect_chunks_cover(batches, chunks);
  expect_every_record_once(batches, chunks);
  expect_every_pair_once(batches, chunks);
  expect_tiles_ordered(chunks);
}

TEST(Chunks, HoldEveryRecordAndEveryPairOnce) {
  expect_all(scene(11, 30, 3));
  expect_all(scene(40, 9000, 5));
}

TEST(Chunks, HoldThemWhereOneImageSeesAPointTwice) {
  Problem problem = scene(11, 500, 4);
  for (std::size_t i = 0; i < 300; i += 5)
    problem.add_observation(problem.observation_image[i], problem.observation_point[i], 1, 2);
  expect_all(problem);
  const Chunks chunks = cut_into_chunks(arrange(problem), 11, ChunkLists::pairs);
  EXPECT_TRUE(std::any_of(chunks.tiles.begin(), chunks.tiles.end(),
                          [](const Tile& t) { return t.row == t.column; }));
}

TEST(Chunks, HoldThemWithMoreImagesThanATableOfAllPairs) {
  // Beyond 4096 images the pairs are numbered in a hash table.
  Problem problem;
  for (int i = 0; i < 5000; ++i) problem.add_image({}, Camera{});
  for (std::uint32_t j = 0; j < 2000; ++j) {
    problem.add_point(j, 0, -5);
    for (std::uint32_t o = 0; o < 3; ++o)
      problem.add_observation((j * 7 + o * 613) % 5000, j, 0, 0);
  }
  expect_all(problem);
}

TEST(Chunks, RecordNumbersHoldTheLongestTrack) {
  // One point as long as a chunk's 16-bit record numbers allow; pairs would be too many to list
  // here, records are not.
  Problem problem = scene(11, 100, 4);
  const auto point = problem.add_point(0, 0, 0);
  for (std::uint32_t i = 0; i < Chunks::kLongestTrack; ++i)
    problem.add_observation(i % 11, point, 0, 0);
  const Batches batches = arrange(problem);
  EXPECT_EQ(batches.longest_track, Chunks::kLongestTrack);
  const Chunks chunks = cut_into_chunks(batches, 11, ChunkLists::diagonal);
  EXPECT_LT(8 * chunks.most_batches, 65536u);
  expect_chunks_cover(batches, chunks);
  expect_every_record_once(batches, chunks);
}

TEST(Chunks, SlicesShareTheWork) {
  const Problem problem = scene(40, 30000, 5);
  const Chunks chunks = cut_into_chunks(arrange(problem), 40, ChunkLists::pairs);
  const std::size_t slices = chunks.slices.size() - 1;
  ASSERT_GT(slices, 2u);
  std::vector<double> pairs(slices, 0);
  for (std::size_t s = 0; s < slices; ++s)
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c)
      pairs[s] += 700.0 * 8 *
                  static_cast<double>(chunks.chunks[c].end_batch - chunks.chunks[c].first_batch);
  for (std::size_t s = 0; s < slices; ++s)
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c)
      for (std::uint64_t r = chunks.chunks[c].first_pair_run; r < chunks.chunks[c].end_pair_run;
           ++r)
        pairs[s] += 490.0 * chunks.pair_runs[r].count;
  const auto [least, most] = std::minmax_element(pairs.begin(), pairs.end());
  EXPECT_LT(*most, 2.5 * *least);  // a slice ends with a whole chunk
}

TEST(Chunks, ListOnlyWhatIsAskedFor) {
  const Batches batches = arrange(scene(11, 300, 4));
  const Chunks diagonal = cut_into_chunks(batches, 11, ChunkLists::diagonal);
  expect_chunks_cover(batches, diagonal);
  expect_every_record_once(batches, diagonal);
  EXPECT_TRUE(diagonal.tiles.empty());
  EXPECT_EQ(diagonal.pairs.size(), 0u);
  const Chunks none = cut_into_chunks(batches, 11, ChunkLists::none);
  expect_chunks_cover(batches, none);
  EXPECT_EQ(none.diagonal.size(), 0u);
  EXPECT_EQ(none.pairs.size(), 0u);
}

}  // namespace
}  // namespace sheaf
