// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "platform/buffer.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Where the observations of a problem stand in its arrangement, so that other measurements and
/// sigmas of them come into it without arranging anything anew.
class Refill {
 public:
  Refill() = default;
  /// batches: as arrange() has made them of this problem, without those of skip.
  Refill(const Problem& problem, const std::vector<std::uint8_t>& skip, const Batches& batches,
         Threads& threads);

  /// Writes the measurements and, where the batches have them, the inverse sigmas of a problem
  /// whose observations are of the same points in the same images.
  void fill(const Problem& problem, Threads& threads, Batches& batches) const;

 private:
  Buffer<std::uint64_t> observation_;  ///< 8 per batch
};

}  // namespace sheaf
