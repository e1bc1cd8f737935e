// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "platform/buffer.h"
#include "platform/parallel.h"

namespace sheaf {

/// `sums` holds `slices` sets of equal size, one behind the other: adds them into the first, in
/// order.
void add_slices(Buffer<double>& sums, std::size_t slices, Threads& threads);

constexpr std::size_t kMostSlices = 32;

/// Slices whose sums are kept apart: about equal work, few enough that their sums cost little.
/// flops: of one linearisation, by linearize_flops (lists/block_layout.h).
int count_slices(double flops, std::uint64_t tiles, std::uint64_t images);
/// Whether that is decided by how little there is to do: a window, not a scene.
bool is_small(double flops, std::uint64_t tiles, std::uint64_t images);

}  // namespace sheaf
