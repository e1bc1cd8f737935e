// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "lists/block_layout.h"
#include "lists/chunks.h"
#include "platform/buffer.h"
#include "platform/parallel.h"

namespace sheaf {

/// The sums over camera blocks of an implicit product, double whatever the product's own precision.
/// Slices of chunks sum apart and are added in order.
class ProductSums {
 public:
  /// saved: doubles that a thread's product keeps of a group.
  ProductSums(const Chunks& chunks, std::size_t blocks, std::size_t saved, Threads& threads)
      : chunks_(chunks),
        threads_(threads),
        blocks_(blocks),
        slices_(chunks.slices.size() - 1),
        saved_doubles_(saved),
        sums_(slices_ * kProductRecord * blocks_),
        saved_(static_cast<std::size_t>(threads.count())) {}

  /// Calls task(block) for every block.
  template <class Task>
  void for_each_block(const Task& task) {
    constexpr std::size_t kBlocksPerTask = 1024;
    threads_.for_ranges(blocks_, kBlocksPerTask, [&](std::size_t i, std::size_t end) {
      for (; i < end; ++i) task(i);
    });
  }

  /// Calls product(chunk, saved, sums) for every chunk, then finish(block, total) for every block
  /// with its sums, kProductRecord of them.
  template <class Product, class Finish>
  void run(const Product& product, const Finish& finish) {
    const std::size_t stride = kProductRecord * blocks_;
    threads_.for_each(slices_, [&](std::size_t s) {
      Buffer<double>& saved = saved_[static_cast<std::size_t>(threads_.worker())];
      if (saved.size() == 0) saved.allocate(saved_doubles_);
      double* sums = &sums_[s * stride];
      std::fill_n(sums, stride, 0.0);
      for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
        product(chunks_.chunks[c], saved.data(), sums);
    });
    for_each_block([&](std::size_t i) {
      double* total = &sums_[kProductRecord * i];
      for (std::size_t s = 1; s < slices_; ++s)
        for (std::size_t k = 0; k < 9; ++k) total[k] += total[s * stride + k];
      finish(i, total);
    });
  }

  std::size_t num_blocks() const { return blocks_; }
  std::uint64_t bytes() const { return sums_.bytes() + saved_.size() * 8 * saved_doubles_; }

 private:
  const Chunks& chunks_;
  Threads& threads_;
  const std::size_t blocks_, slices_, saved_doubles_;
  Buffer<double> sums_;                ///< kProductRecord per block, one set per slice
  std::vector<Buffer<double>> saved_;  ///< one per thread
};

}  // namespace sheaf
