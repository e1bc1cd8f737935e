// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "lists/batches.h"
#include "systems/plan.h"

namespace sheaf {

/// What the process will be resident with beyond the problem and its batches, once it has solved
/// with this solver: arrays as they are mapped, threads and code included.
std::uint64_t forecast_bytes(const WorkCounts& counts, const Plan& plan, int threads);

/// Runs of pairs of one tile within a chunk, over all chunks: counted in some of them, or a bound
/// where that is small.
std::uint64_t estimate_pair_runs(const Batches& batches, const WorkCounts& counts);

}  // namespace sheaf
