// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "sheaf/error.h"
#include "sheaf/options.h"
#include "systems/arrangement.h"
#include "systems/plan.h"

namespace sheaf {

/// What the process holds once the problem is arranged, and what it held at most so far.
struct MemoryHeld {
  std::uint64_t resident_bytes = 0, peak_bytes = 0;
};

/// The solver asked for, or the one that the counts recommend; under a memory limit the leanest
/// that fits. Errors: ErrorCode::memory_limit when none fits, ErrorCode::usage when the one asked
/// for cannot solve the problem.
struct Choice {
  Plan plan;
  std::uint64_t forecast_bytes = 0;  ///< of the process
  /// What the choice may be thought over by, once conjugate gradients have run; null where it
  /// stands.
  std::shared_ptr<const WorkCounts> counts{};
};
Result<Choice> choose_solver(const WorkCounts& counts, const SolveOptions& options, int threads,
                             const MemoryHeld& held);

/// A forecast over the limit, in words a user can act on.
Error over_memory_limit(std::uint64_t needed, std::uint64_t limit, const std::string& more = "");

/// Points held and no lens shared: each image by itself. `batches`: count_image_batches.
Result<Choice> choose_for_images(const Columns& columns, std::uint64_t batches,
                                 const SolveOptions& options, const MemoryHeld& held);

/// Lenses of any model: pairs are listed where the matrix is to be formed.
struct LensChoice {
  Choice choice;
  LensChunks chunks;
};
Result<LensChoice> choose_for_lenses(const Arrangement& arranged, const SolveOptions& options,
                                     Threads& threads);

}  // namespace sheaf
