// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/solve.h"
#include "systems/system.h"

namespace sheaf {

/// `minimize` with the options' loss. A scale that is given takes one round. An automatic one is
/// set from the residuals, and again after each accepted step, until it changes by less than 5% or
/// five rounds have passed; then it stays, and the steps go on to the end. A graduated loss starts
/// with a scale that holds almost all residuals in its convex part and at most halves it from round
/// to round. Fills the summary's rounds too.
void minimize_in_rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
                        Summary& summary);

}  // namespace sheaf
