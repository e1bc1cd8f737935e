// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/solve.h"
#include "solve/trust_region.h"
#include "systems/system.h"

namespace sheaf {

/// `minimize` with the options' loss. A scale that is given takes one round. An automatic one is
/// set from the residuals, and again after each accepted step while these gain much; then it stays,
/// and the steps go on to the end. Should the residuals there ask for another by more than 5 %, it
/// moves on from there. A graduated loss starts with a scale that holds almost all residuals in its
/// convex part. No scale falls to less than half in a step. Fills the summary's rounds too.
/// `history`: one that is set is gone on from, with the last round's scale, which must be final; it
/// is left as the last step left it. `hooks`, and what is returned: as for minimize.
bool minimize_in_rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
                        Summary& summary, std::optional<LoopHistory>* history = nullptr,
                        const Hooks* hooks = nullptr);

}  // namespace sheaf
