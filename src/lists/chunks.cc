// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/chunks.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "lists/block_layout.h"
#include "lists/slices.h"
#include "platform/cancel.h"
#include "platform/parallel.h"
#include "platform/shared_word.h"

namespace sheaf {
namespace {

/// Numbers the image pairs that occur, in order of row and column.
class TileNumbers {
 public:
  TileNumbers(const Batches& batches, std::uint32_t num_images, Threads& threads)
      : images_(num_images) {
    dense_ = images_ <= kDenseImages;
    if (dense_) number_.assign(std::size_t(images_) * (images_ + 1) / 2, kNone);
    const std::size_t groups = batches.groups.size();
    threads.for_ranges(groups, dense_ ? kGroups : groups, [&](std::size_t g, std::size_t end) {
      poll_cancelled();
      for_each_image_set(batches, g, end, [&](const std::vector<std::uint32_t>& set) {
        for (std::size_t i = 0; i < set.size(); ++i)
          for (std::size_t j = 0; j < i; ++j) mark(set[i], set[j]);
      });
    });
    assign();
  }

  /// The numbers of one image's tiles; at(column) for columns up to the image.
  class Row {
   public:
    Row(const TileNumbers& numbers, std::uint32_t row)
        : dense_(numbers.dense_ ? &numbers.number_[triangular(row, 0)] : nullptr),
          sparse_(numbers.sparse_),
          row_(row) {}
    std::uint32_t at(std::uint32_t column) const {
      return dense_ != nullptr ? dense_[column] : sparse_.at(key(row_, column));
    }

   private:
    const std::uint32_t* dense_;
    const std::unordered_map<std::uint64_t, std::uint32_t>& sparse_;
    std::uint32_t row_;
  };
  Row row(std::uint32_t image) const { return Row(*this, image); }
  std::vector<Tile> take_tiles() { return std::move(tiles_); }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  static constexpr std::uint32_t kDenseImages = 4096;
  static constexpr std::size_t kGroups = 256;

  static std::size_t triangular(std::uint32_t row, std::uint32_t column) {
    return std::size_t(row) * (row + 1) / 2 + column;
  }
  static std::uint64_t key(std::uint32_t row, std::uint32_t column) {
    return std::uint64_t(row) << 32 | column;
  }
  void mark(std::uint32_t row, std::uint32_t column) {
    if (!dense_) {
      sparse_.emplace(key(row, column), 0);
      return;
    }
    // Most are marked already: reading first keeps the line shared among threads.
    std::uint32_t& number = number_[triangular(row, column)];
    if (load_shared(number) != 0) store_shared(number, 0u);
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
  /// Where the key's next item goes.
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

/// visit(image, local record) for each record of a chunk.
template <class Visit>
void for_each_record(const Batches& batches, const Chunk& chunk, const Visit& visit) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    const std::uint64_t first = 8 * group.first_batch, chunk_first = 8 * chunk.first_batch;
    for (std::uint64_t at = first; at < first + 8 * std::uint64_t(group.track); at += 8)
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        visit(batches.image[at + l], static_cast<std::uint16_t>(at - chunk_first + l));
  }
}

/// visit(images of the lane, local record, o) for each record with the position o in its track:
/// its partners are the o records before it, eight apart, of images[0], images[8], ...
template <class Visit>
void for_each_partnered(const Batches& batches, const Chunk& chunk, const Visit& visit) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    const std::uint64_t base = 8 * (group.first_batch - chunk.first_batch);
    const std::uint32_t* images = &batches.image[8 * group.first_batch];
    for (std::uint32_t o = 1; o < group.track; ++o)
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        visit(images + l, static_cast<std::uint16_t>(base + 8 * std::uint64_t(o) + l), o);
  }
}

/// Fills the diagonal's records from `listed` on; returns the end of its runs.
DiagonalRun* list_diagonal(const Batches& batches, const Chunk& chunk, Runs& runs,
                           std::uint64_t listed, std::uint16_t* diagonal, DiagonalRun* out) {
  runs.start(listed);
  for_each_record(batches, chunk, [&](std::uint32_t image, std::uint16_t) { runs.count(image); });
  runs.close(listed, [&](std::uint32_t image, std::uint32_t n, std::uint64_t at) {
    *out++ = {image, n, at};
  });
  for_each_record(batches, chunk, [&](std::uint32_t image, std::uint16_t record) {
    diagonal[runs.place(image)] = record;
  });
  runs.clear();
  return out;
}

/// Fills the pairs from `listed` on; returns the end of its runs. `tile_of` has room for the pairs
/// of any chunk.
PairRun* list_pairs(const Batches& batches, const TileNumbers& numbers, const Chunk& chunk,
                    Runs& runs, Buffer<std::uint32_t>& tile_of, std::uint64_t listed,
                    RecordPair* pairs, PairRun* out) {
  runs.start(listed);
  std::uint32_t* tile = tile_of.data();
  for_each_partnered(batches, chunk, [&](const std::uint32_t* images, std::uint16_t, auto o) {
    const TileNumbers::Row row = numbers.row(images[8 * o]);
    for (std::uint32_t i = 0; i < o; ++i) {
      *tile = row.at(images[8 * i]);
      runs.count(*tile++);
    }
  });
  runs.close(listed, [&](std::uint32_t tile_number, std::uint32_t n, std::uint64_t at) {
    *out++ = {tile_number, n, at};
  });
  tile = tile_of.data();
  for_each_partnered(batches, chunk, [&](const std::uint32_t*, std::uint16_t record, auto o) {
    for (std::uint32_t i = 0; i < o; ++i)
      pairs[runs.place(*tile++)] = {record, static_cast<std::uint16_t>(record - 8 * (o - i))};
  });
  runs.clear();
  return out;
}

/// Records in a chunk, and pairs of them.
std::uint64_t count_records(const Batches& batches, const Chunk& chunk) {
  std::uint64_t records = 0;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    records += std::uint64_t(batches.groups[g].track) * batches.groups[g].lanes;
  return records;
}
std::uint64_t count_pairs(const Batches& batches, const Chunk& chunk) {
  std::uint64_t pairs = 0;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    pairs += std::uint64_t(group.track) * (group.track - 1) / 2 * group.lanes;
  }
  return pairs;
}

/// What precedes each chunk, and all chunks, of what count(chunk) counts.
template <class Count>
std::vector<std::uint64_t> sums_before(const std::vector<Chunk>& chunks, const Count& count) {
  std::vector<std::uint64_t> sums{0};
  sums.reserve(chunks.size() + 1);
  for (const Chunk& chunk : chunks) sums.push_back(sums.back() + count(chunk));
  return sums;
}

/// Lists the runs of every chunk, in order: list(c, to) writes those of chunk c and returns their
/// end; a chunk has at most `keys` and at most items[c + 1] - items[c]. Sets the chunks' first and
/// end.
template <class Run, class List>
Buffer<Run> list_runs(std::vector<Chunk>& chunks, const std::vector<std::uint64_t>& items,
                      std::size_t keys, std::uint64_t Chunk::*first, std::uint64_t Chunk::*end,
                      Threads& threads, const List& list) {
  constexpr std::size_t kChunks = 8;
  std::vector<Buffer<Run>> parts((chunks.size() + kChunks - 1) / kChunks);
  threads.for_ranges(chunks.size(), kChunks, [&](std::size_t c, std::size_t last) {
    poll_cancelled();
    Buffer<Run>& part = parts[c / kChunks];
    part.allocate(std::min<std::size_t>(items[last] - items[c], keys * (last - c)));
    for (Run* to = part.data(); c < last; ++c) {
      chunks[c].*first = static_cast<std::uint64_t>(to - part.data());
      to = list(c, to);
      chunks[c].*end = static_cast<std::uint64_t>(to - part.data());
    }
  });
  std::uint64_t sum = 0;
  std::vector<std::uint64_t> before;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    before.push_back(sum);
    sum += chunks[std::min(chunks.size(), (p + 1) * kChunks) - 1].*end;
  }
  Buffer<Run> runs(sum);
  threads.for_ranges(chunks.size(), kChunks, [&](std::size_t c, std::size_t last) {
    poll_cancelled();
    const std::size_t p = c / kChunks;
    std::copy_n(parts[p].data(), chunks[last - 1].*end, runs.data() + before[p]);
    for (; c < last; ++c) chunks[c].*first += before[p], chunks[c].*end += before[p];
    parts[p] = {};
  });
  return runs;
}

void list_diagonals(const Batches& batches, std::uint32_t num_images, Chunks& out,
                    Threads& threads) {
  const auto before =
      sums_before(out.chunks, [&](const Chunk& chunk) { return count_records(batches, chunk); });
  out.diagonal.allocate(before.back());
  std::vector<std::optional<Runs>> of_worker(threads.count());
  out.diagonal_runs = list_runs<DiagonalRun>(
      out.chunks, before, num_images, &Chunk::first_diagonal_run, &Chunk::end_diagonal_run, threads,
      [&](std::size_t c, DiagonalRun* to) {
        std::optional<Runs>& runs = of_worker[threads.worker()];
        if (!runs) runs.emplace(num_images);
        return list_diagonal(batches, out.chunks[c], *runs, before[c], out.diagonal.data(), to);
      });
}

void list_all_pairs(const Batches& batches, std::uint32_t num_images, Chunks& out,
                    Threads& threads) {
  TileNumbers numbers(batches, num_images, threads);
  out.tiles = numbers.take_tiles();
  const auto before =
      sums_before(out.chunks, [&](const Chunk& chunk) { return count_pairs(batches, chunk); });
  std::uint64_t most = 0;
  for (std::size_t c = 0; c < out.chunks.size(); ++c)
    most = std::max(most, before[c + 1] - before[c]);
  out.pairs.allocate(before.back());
  struct Scratch {
    Runs runs;
    Buffer<std::uint32_t> tile_of;
  };
  std::vector<std::optional<Scratch>> of_worker(threads.count());
  out.pair_runs =
      list_runs<PairRun>(out.chunks, before, out.tiles.size(), &Chunk::first_pair_run,
                         &Chunk::end_pair_run, threads, [&](std::size_t c, PairRun* to) {
                           std::optional<Scratch>& mine = of_worker[threads.worker()];
                           if (!mine)
                             mine = Scratch{Runs(out.tiles.size()), Buffer<std::uint32_t>(most)};
                           return list_pairs(batches, numbers, out.chunks[c], mine->runs,
                                             mine->tile_of, before[c], out.pairs.data(), to);
                         });
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

Chunks cut_into_chunks(const Batches& batches, std::uint32_t num_images, ChunkLists lists,
                       Threads& threads, std::uint64_t most_batches) {
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
    while (g < groups && end_of(g) - chunk.first_batch <= most_batches);
    chunk.end_group = g;
    chunk.end_batch = end_of(g - 1);
    out.most_batches = std::max(out.most_batches, chunk.end_batch - chunk.first_batch);
    out.chunks.push_back(chunk);
  }
  if (lists != ChunkLists::none) list_diagonals(batches, num_images, out, threads);
  if (lists == ChunkLists::pairs) list_all_pairs(batches, num_images, out, threads);
  out.slices = cut_into_slices(out, num_images);
  return out;
}

Chunks cut_into_chunks(const Batches& batches, std::uint32_t num_images, ChunkLists lists,
                       std::uint64_t most_batches) {
  Threads alone(1);
  return cut_into_chunks(batches, num_images, lists, alone, most_batches);
}

}  // namespace sheaf
