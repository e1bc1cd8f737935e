// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lists/chunks.h"
#include "platform/buffer.h"

namespace sheaf {

/// A symmetric matrix of blocks of up to nine columns: of each coupled pair row >= column one tile,
/// nine rows of nine.
class BlockTiles {
 public:
  static constexpr std::size_t kDoubles = 81;

  /// pairs: row in the upper 32 bits, column <= row in the lower ones; sorted, each once, the
  /// diagonal among them. Throws std::bad_alloc.
  BlockTiles(std::size_t blocks, std::vector<std::uint64_t> pairs)
      : pairs_(std::move(pairs)), begin_(blocks + 1, 0), values_(kDoubles * pairs_.size()) {
    values_.fill(0);
    for (const std::uint64_t pair : pairs_) ++begin_[(pair >> 32) + 1];
    for (std::size_t b = 0; b < blocks; ++b) begin_[b + 1] += begin_[b];
  }

  std::size_t size() const { return pairs_.size(); }
  std::uint32_t row(std::size_t tile) const {
    return static_cast<std::uint32_t>(pairs_[tile] >> 32);
  }
  std::uint32_t column(std::size_t tile) const { return static_cast<std::uint32_t>(pairs_[tile]); }
  double* at(std::size_t tile) { return values_.data() + kDoubles * tile; }
  const double* at(std::size_t tile) const { return values_.data() + kDoubles * tile; }

  /// The tile of a coupled pair, row >= column.
  std::size_t find(std::uint32_t row, std::uint32_t column) const {
    const auto first = pairs_.begin() + static_cast<std::ptrdiff_t>(begin_[row]);
    const auto end = pairs_.begin() + static_cast<std::ptrdiff_t>(begin_[row + 1]);
    return static_cast<std::size_t>(
        std::lower_bound(first, end, std::uint64_t(row) << 32 | column) - pairs_.begin());
  }
  /// visit(tile, a, b) of each pair blocks[a] >= blocks[b], blocks ascending; each tile is on its
  /// way from memory while the one before is worked on.
  template <class Visit>
  void for_pairs(const std::vector<std::uint32_t>& blocks, const Visit& visit) const {
    std::size_t before = 0, before_a = 0, before_b = 0;
    for (std::size_t a = 0; a < blocks.size(); ++a) {
      std::size_t tile = begin_[blocks[a]];
      for (std::size_t b = 0; b <= a; ++b) {
        tile = find_behind(tile, blocks[a], blocks[b]);
        for (std::size_t k = 0; k < kDoubles; k += 8) __builtin_prefetch(at(tile) + k);
        if (a > 0) visit(before, before_a, before_b);
        before = tile, before_a = a, before_b = b;
      }
    }
    if (!blocks.empty()) visit(before, before_a, before_b);
  }
  double* of(std::uint32_t row, std::uint32_t column) { return at(find(row, column)); }
  const double* of(std::uint32_t row, std::uint32_t column) const { return at(find(row, column)); }

 private:
  /// Of a row's tiles, at `from` or behind it.
  std::size_t find_behind(std::size_t from, std::uint32_t row, std::uint32_t column) const {
    const std::uint64_t pair = std::uint64_t(row) << 32 | column;
    const std::size_t guess = from + (pair - pairs_[from]);  // where no column is left out
    if (guess < begin_[row + 1] && pairs_[guess] == pair) return guess;
    const auto end = static_cast<std::ptrdiff_t>(std::min<std::size_t>(guess, begin_[row + 1]));
    return static_cast<std::size_t>(
        std::lower_bound(pairs_.begin() + static_cast<std::ptrdiff_t>(from), pairs_.begin() + end,
                         pair) -
        pairs_.begin());
  }

  std::vector<std::uint64_t> pairs_;
  std::vector<std::uint64_t> begin_;  ///< of each row's tiles
  Buffer<double> values_;
};

}  // namespace sheaf
