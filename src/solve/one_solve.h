// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/solve.h"
#include "solve/attempts.h"

namespace sheaf {

/// Whether the options are ones that any problem could be solved with.
Result<void> check_options(const SolveOptions& options);
/// Whether the problem is one that these options can be asked of.
Result<void> check_problem(const Problem& problem, const SolveOptions& options);

/// Refines a problem that was checked, with everything that a summary says. The options come out
/// with what the run has changed of them. kept: what an earlier solve with the same options,
/// kernels and threads left, or null; a problem of its structure is then refined in what is there,
/// to the same bits.
Result<void> solve_once(Problem& problem, SolveOptions& options, const Kernels& kernels,
                        Threads& threads, const Stopwatch& clock, KeptHome* kept, Summary& summary);

}  // namespace sheaf
