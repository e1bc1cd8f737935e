// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/chunks.h"

#include <algorithm>
#include <unordered_map>

#include "linear/plan.h"

namespace sheaf {
namespace {

/// Numbers the image pairs that occur, in order of row and column.
class TileNumbers {
 public:
  TileNumbers(const Batches& batches, std::uint32_t num_images) : images_(num_images) {
    dense_ = images_ <= kDenseImages;
    if (dense_) number_.assign(std::size_t(images_) * (images_ + 1) / 2, kNone);
    std::vector<std::uint32_t> previous, set;
    for (std::size_t g = 0; g < batches.groups.size(); ++g) {
      const Batches::Group& group = batches.groups[g];
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        set.clear();
        for (std::uint32_t o = 0; o < group.track; ++o)
          set.push_back(batches.image[8 * (group.first_batch + o) + l]);
        if (set == previous) continue;  // sorted by image set: most points repeat the last one's
        for (std::size_t i = 0; i < set.size(); ++i)
          for (std::size_t j = 0; j < i; ++j) mark(set[i], set[j]);
        previous.swap(set);
      }
    }
    assign();
  }

  std::uint32_t at(std::uint32_t row, std::uint32_t column) const {
    return dense_ ? number_[triangular(row, column)] : sparse_.at(key(row, column));
  }
  std::vector<Tile> take_tiles() { return std::move(tiles_); }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  static constexpr std::uint32_t kDenseImages = 4096;

  static std::size_t triangular(std::uint32_t row, std::uint32_t column) {
    return std::size_t(row) * (row + 1) / 2 + column;
  }
  static std::uint64_t key(std::uint32_t row, std::uint32_t column) {
    return std::uint64_t(row) << 32 | column;
  }
  void mark(std::uint32_t row, std::uint32_t column) {
    if (dense_)
      number_[triangular(row, column)] = 0;
    else
      sparse_.emplace(key(row, column), 0);
  }
  void assign() {
    if (dense_) {
      for (std::uint32_t i = 0; i < images_; ++i)
        for (std::uint32_t j = 0; j <= i; ++j)
          if (std::uint32_t& n = number_[triangular(i, j)]; n != kNone) n = add({i, j});
      return;
    }
    std::vector<std::uint64_t> keys;
    keys.reserve(sparse_.size());
    for (const auto& entry : sparse_) keys.push_back(entry.first);
    std::sort(keys.begin(), keys.end());
    for (std::uint64_t k : keys)
      sparse_[k] = add({static_cast<std::uint32_t>(k >> 32), static_cast<std::uint32_t>(k)});
  }
  std::uint32_t add(Tile tile) {
    tiles_.push_back(tile);
    return static_cast<std::uint32_t>(tiles_.size() - 1);
  }

  std::uint32_t images_;
  bool dense_;
  std::vector<std::uint32_t> number_;
  std::unordered_map<std::uint64_t, std::uint32_t> sparse_;
  std::vector<Tile> tiles_;
};

/// Sorts one chunk's pairs (or records) by their tile (or image) with a counting sort over the
/// keys that occur; reused from chunk to chunk.
class Runs {
 public:
  explicit Runs(std::size_t keys) : count_(keys, 0) {}
  void count(std::uint32_t key) {
    if (count_[key]++ == 0) touched_.push_back(key);
  }
  /// Calls run(key, count, first) in order of keys; afterwards place(key) gives each item's slot.
  template <class Run>
  void close(std::uint64_t first, const Run& run) {
    std::sort(touched_.begin(), touched_.end());
    for (std::uint32_t key : touched_) {
      const std::uint32_t n = count_[key];
      run(key, n, first);
      count_[key] = static_cast<std::uint32_t>(first - base_);
      first += n;
    }
  }
  void start(std::uint64_t base) { base_ = base; }
  std::uint64_t place(std::uint32_t key) { return base_ + count_[key]++; }
  void clear() {
    for (std::uint32_t key : touched_) count_[key] = 0;
    touched_.clear();
  }

 private:
  std::vector<std::uint32_t> count_;
  std::vector<std::uint32_t> touched_;
  std::uint64_t base_ = 0;
};

/// visit(image, local record, lane's first local record, position in the track) for each record.
template <class Visit>
void for_each_record(const Batches& batches, const Chunk& chunk, const Visit& visit) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    const std::uint64_t base = group.first_batch - chunk.first_batch;
    for (std::uint32_t o = 0; o < group.track; ++o)
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        visit(group.first_batch, static_cast<std::uint16_t>(8 * (base + o) + l), o, l);
  }
}

void list_diagonal(const Batches& batches, Chunk& chunk, Runs& runs, Chunks& out) {
  runs.start(out.diagonal.size());
  for_each_record(batches, chunk, [&](std::uint64_t first, std::uint16_t, auto o, auto l) {
    runs.count(batches.image[8 * (first + o) + l]);
  });
  chunk.first_diagonal_run = out.diagonal_runs.size();
  std::uint64_t total = 0;
  runs.close(out.diagonal.size(), [&](std::uint32_t image, std::uint32_t n, std::uint64_t at) {
    out.diagonal_runs.push_back({image, n, at});
    total += n;
  });
  chunk.end_diagonal_run = out.diagonal_runs.size();
  out.diagonal.resize(out.diagonal.size() + total);
  for_each_record(batches, chunk, [&](std::uint64_t first, std::uint16_t r, auto o, auto l) {
    out.diagonal[runs.place(batches.image[8 * (first + o) + l])] = r;
  });
  runs.clear();
}

void list_pairs(const Batches& batches, const TileNumbers& numbers, Chunk& chunk, Runs& runs,
                std::vector<std::uint32_t>& tile_of, Chunks& out) {
  tile_of.clear();
  runs.start(out.pairs.size());
  for_each_record(batches, chunk, [&](std::uint64_t first, std::uint16_t, auto o, auto l) {
    const std::uint32_t* image = &batches.image[8 * first + l];
    for (std::uint32_t i = 0; i < o; ++i) {
      tile_of.push_back(numbers.at(image[8 * o], image[8 * i]));
      runs.count(tile_of.back());
    }
  });
  chunk.first_pair_run = out.pair_runs.size();
  runs.close(out.pairs.size(), [&](std::uint32_t tile, std::uint32_t n, std::uint64_t at) {
    out.pair_runs.push_back({tile, n, at});
  });
  chunk.end_pair_run = out.pair_runs.size();
  out.pairs.resize(out.pairs.size() + tile_of.size());
  std::size_t next = 0;
  for_each_record(batches, chunk, [&](std::uint64_t, std::uint16_t r, auto o, auto) {
    for (std::uint32_t i = 0; i < o; ++i)
      out.pairs[runs.place(tile_of[next++])] = {r, static_cast<std::uint16_t>(r - 8 * (o - i))};
  });
  runs.clear();
}

std::vector<std::uint32_t> cut_into_slices(const Chunks& c, std::uint32_t num_images) {
  std::vector<double> work{0};
  for (const Chunk& chunk : c.chunks) {
    std::uint64_t pairs = 0;
    for (std::uint64_t r = chunk.first_pair_run; r < chunk.end_pair_run; ++r)
      pairs += c.pair_runs[r].count;
    work.push_back(work.back() + linearize_flops(chunk.end_batch - chunk.first_batch, pairs));
  }
  const int count = count_slices(work.back(), c.tiles.size(), num_images);
  std::vector<std::uint32_t> slices{0};
  for (int s = 1; s < count; ++s) {
    const double target = work.back() * s / count;
    const auto cut = std::lower_bound(work.begin(), work.end(), target) - work.begin();
    slices.push_back(std::max(slices.back(), static_cast<std::uint32_t>(cut)));
  }
  slices.push_back(static_cast<std::uint32_t>(c.chunks.size()));
  return slices;
}

}  // namespace

Chunks cut_into_chunks(const Batches& batches, std::uint32_t num_images, ChunkLists lists) {
  Chunks out;
  const std::uint32_t groups = static_cast<std::uint32_t>(batches.groups.size());
  for (std::uint32_t g = 0; g < groups;) {
    Chunk chunk{};
    chunk.first_group = g;
    chunk.first_batch = batches.groups[g].first_batch;
    const auto end_of = [&](std::uint32_t i) {
      return batches.groups[i].first_batch + batches.groups[i].track;
    };
    do ++g;
    while (g < groups && end_of(g) - chunk.first_batch <= Chunks::kBatchesPerChunk);
    chunk.end_group = g;
    chunk.end_batch = end_of(g - 1);
    out.most_batches = std::max(out.most_batches, chunk.end_batch - chunk.first_batch);
    out.chunks.push_back(chunk);
  }
  if (lists != ChunkLists::none) {
    out.diagonal.reserve(batches.observations);
    Runs by_image(num_images);
    for (Chunk& chunk : out.chunks) list_diagonal(batches, chunk, by_image, out);
  }
  if (lists == ChunkLists::pairs) {
    TileNumbers numbers(batches, num_images);
    out.tiles = numbers.take_tiles();
    std::uint64_t pairs = 0;
    for (const Batches::Group& group : batches.groups)
      pairs += std::uint64_t(group.track) * (group.track - 1) / 2 * group.lanes;
    out.pairs.reserve(pairs);
    Runs by_tile(out.tiles.size());
    std::vector<std::uint32_t> tile_of;
    for (Chunk& chunk : out.chunks) list_pairs(batches, numbers, chunk, by_tile, tile_of, out);
  }
  out.slices = cut_into_slices(out, num_images);
  return out;
}

}  // namespace sheaf
