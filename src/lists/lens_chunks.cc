// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/lens_chunks.h"

#include <algorithm>

#include "platform/parallel.h"

namespace sheaf {
namespace {

struct KeyedPair {
  std::uint64_t key;  ///< row << 32 | column
  RecordPair pair;
};

std::uint64_t key_of(std::uint32_t row, std::uint32_t column) {
  return std::uint64_t(row) << 32 | column;
}

/// A T record of one point, with its block and whose it is.
struct PointRecord {
  std::uint32_t block, lens;
  std::uint16_t record;
};

/// The lens of each block beyond the images'.
std::vector<std::uint32_t> lenses_of_blocks(const LensTracks& tracks) {
  std::vector<std::uint32_t> out(tracks.num_blocks, 0);
  for (std::uint32_t c = 0; c < tracks.lenses.size(); ++c) {
    const LensPlaces& lens = tracks.lenses[c];
    for (std::uint32_t b = lens.first_block; b < lens.first_block + lens.blocks; ++b) out[b] = c;
  }
  return out;
}

/// Pairs of one chunk that have a slot in them, but none between a lens and itself or an image of
/// its own; by tile.
class SlotPairs {
 public:
  SlotPairs(const Batches& batches, const LensTracks& tracks,
            const std::vector<std::uint32_t>& lens_of)
      : batches_(batches), tracks_(tracks), lens_of_(lens_of) {}

  std::vector<KeyedPair> list(const Chunk& chunk) {
    out_.clear();
    for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
      for (std::uint32_t l = 0; l < batches_.groups[g].lanes; ++l) list_point(chunk, g, l);
    std::stable_sort(out_.begin(), out_.end(),
                     [](const KeyedPair& a, const KeyedPair& b) { return a.key < b.key; });
    return out_;
  }

 private:
  void list_point(const Chunk& chunk, std::uint32_t g, std::uint32_t lane) {
    const std::uint64_t first = tracks_.first_slot[g];
    const std::uint64_t record =
        8 * (chunk.end_batch - chunk.first_batch + slots_before(tracks_, chunk, g)) + lane;
    slots_.clear();
    for (std::uint32_t s = 0; s < tracks_.slots_of(g); ++s)
      if (const std::int32_t block = tracks_.slot_block[8 * (first + s) + lane]; block >= 0)
        slots_.push_back({static_cast<std::uint32_t>(block), lens_of_[std::size_t(block)],
                          static_cast<std::uint16_t>(record + 8 * s)});
    const Batches::Group& group = batches_.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      const PointRecord seen{batches_.image[8 * b + lane], tracks_.lens[8 * b + lane],
                             static_cast<std::uint16_t>(8 * (b - chunk.first_batch) + lane)};
      for (const PointRecord& slot : slots_) add(slot, seen);
    }
    for (std::size_t s = 0; s < slots_.size(); ++s)
      for (std::size_t t = 0; t < s; ++t)
        slots_[s].block > slots_[t].block ? add(slots_[s], slots_[t]) : add(slots_[t], slots_[s]);
  }
  void add(const PointRecord& row, const PointRecord& column) {
    if (row.lens != column.lens)
      out_.push_back({key_of(row.block, column.block), {row.record, column.record}});
  }

  const Batches& batches_;
  const LensTracks& tracks_;
  const std::vector<std::uint32_t>& lens_of_;
  std::vector<PointRecord> slots_;
  std::vector<KeyedPair> out_;
};

void add_own_tiles(const LensTracks& tracks, LensChunks& out) {
  std::vector<Tile>& tiles = out.chunks.tiles;
  const auto add = [&tiles](std::uint32_t row, std::uint32_t column) {
    tiles.push_back({row, column});
    return static_cast<std::uint32_t>(tiles.size() - 1);
  };
  out.tiles.of_image.assign(2 * tracks.image_lens.size(), 0);
  out.tiles.of_lens.assign(tracks.lenses.size(), 0);
  for (std::uint32_t i = 0; i < tracks.image_lens.size(); ++i) {
    const LensPlaces& lens = tracks.lenses[tracks.image_lens[i]];
    for (std::uint32_t j = 0; j < lens.blocks; ++j)
      out.tiles.of_image[2 * i + j] = add(lens.first_block + j, i);
  }
  for (std::size_t c = 0; c < tracks.lenses.size(); ++c) {
    const LensPlaces& lens = tracks.lenses[c];
    if (lens.blocks == 2) out.tiles.of_lens[c] = add(lens.first_block + 1, lens.first_block);
  }
}

/// Numbers the tiles of the listed pairs after all others.
std::vector<std::uint64_t> add_slot_tiles(const std::vector<std::vector<KeyedPair>>& listed,
                                          LensChunks& out) {
  std::vector<std::uint64_t> keys;
  for (const std::vector<KeyedPair>& pairs : listed)
    for (std::size_t p = 0; p < pairs.size(); ++p)
      if (p == 0 || pairs[p].key != pairs[p - 1].key) keys.push_back(pairs[p].key);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  for (std::uint64_t key : keys)
    out.chunks.tiles.push_back(
        {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)});
  return keys;
}

void list_slot_pairs(const Batches& batches, const LensTracks& tracks, LensChunks& out,
                     Threads& threads) {
  const std::vector<std::uint32_t> lens_of = lenses_of_blocks(tracks);
  const std::vector<Chunk>& chunks = out.chunks.chunks;
  std::vector<std::vector<KeyedPair>> listed(chunks.size());
  threads.for_each(chunks.size(), [&](std::size_t c) {
    listed[c] = SlotPairs(batches, tracks, lens_of).list(chunks[c]);
  });
  const auto first_tile = static_cast<std::uint32_t>(out.chunks.tiles.size());
  const std::vector<std::uint64_t> keys = add_slot_tiles(listed, out);
  std::vector<PairRun> runs;
  std::uint64_t count = 0;
  for (const std::vector<KeyedPair>& pairs : listed) count += pairs.size();
  out.slots.pairs.allocate(count);
  std::uint64_t at = 0;
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    Chunk chunk = chunks[c];
    chunk.first_pair_run = runs.size();
    for (std::size_t p = 0; p < listed[c].size(); ++p, ++at) {
      const std::uint64_t key = listed[c][p].key;
      if (p == 0 || key != listed[c][p - 1].key) {
        const auto number = std::lower_bound(keys.begin(), keys.end(), key) - keys.begin();
        runs.push_back({first_tile + static_cast<std::uint32_t>(number), 0, at});
      }
      ++runs.back().count;
      out.slots.pairs[at] = listed[c][p].pair;
    }
    chunk.end_pair_run = runs.size();
    out.slots.chunks.push_back(chunk);
    listed[c] = {};
  }
  out.slots.pair_runs.allocate(runs.size());
  std::copy(runs.begin(), runs.end(), out.slots.pair_runs.begin());
}

}  // namespace

bool LensChunks::possible(const Batches& batches, const LensTracks& tracks) {
  std::uint32_t most = batches.longest_track;
  for (std::size_t g = 0; g < batches.groups.size(); ++g)
    most = std::max(most, batches.groups[g].track + tracks.slots_of(g));
  return most <= Chunks::kLongestTrack;
}

LensChunks cut_lens_chunks(const Batches& batches, const LensTracks& tracks, LensLists lists,
                           Threads& threads) {
  LensChunks out;
  const bool pairs = lists == LensLists::pairs;
  out.chunks = cut_into_chunks(batches, static_cast<std::uint32_t>(tracks.image_lens.size()),
                               pairs ? ChunkLists::pairs : ChunkLists::diagonal, threads);
  if (lists != LensLists::diagonal) add_own_tiles(tracks, out);
  if (pairs && tracks.most_blocks > 0) {
    list_slot_pairs(batches, tracks, out, threads);
  } else {
    out.slots.chunks = out.chunks.chunks;
    for (Chunk& chunk : out.slots.chunks) chunk.first_pair_run = chunk.end_pair_run = 0;
  }
  return out;
}

Columns number_lens_columns(const LensTracks& tracks, const Fixed& fixed) {
  const std::size_t images = tracks.image_lens.size();
  std::vector<char> held(images, fixed.poses);
  for (std::uint32_t i : fixed.pose_ids) held[i] = true;
  Columns out;
  out.of_image.assign(9 * std::size_t(tracks.num_blocks), Columns::kFixed);
  for (std::size_t i = 0; i < images; ++i) {
    if (!held[i])
      for (int k = 0; k < 6; ++k) out.of_image[9 * i + k] = out.count++;
    for (int k = 0; k < tracks.lenses[tracks.image_lens[i]].riders; ++k)
      out.of_image[9 * i + 6 + k] = out.count++;
  }
  for (const LensPlaces& lens : tracks.lenses)
    for (std::size_t j = 0; j < lens.blocks; ++j)
      for (std::size_t k = 0; k < lens.width[j]; ++k)
        out.of_image[9 * (lens.first_block + j) + k] = out.count++;
  return out;
}

Columns image_columns(const LensTracks& tracks, const Columns& columns, bool riders) {
  Columns out;
  const std::size_t images = tracks.image_lens.size();
  out.of_image.assign(columns.of_image.begin(),
                      columns.of_image.begin() + static_cast<std::ptrdiff_t>(9 * images));
  for (std::size_t i = 0; i < out.of_image.size(); ++i) {
    if (!riders && i % 9 >= 6) out.of_image[i] = Columns::kFixed;
    out.count = std::max(out.count, out.of_image[i] + 1);
  }
  return out;
}

}  // namespace sheaf
