// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "linear/system.h"
#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/summary.h"

namespace sheaf {

/// Levenberg-Marquardt with gain-ratio control on any System. Fills the summary's iterations,
/// costs, termination and words; the best state is the system's held one.
/// `since_start` runs since set-up began (the time limit counts from there).
void minimize(System& system, const SolveOptions& options, const Stopwatch& since_start,
              Summary& summary);

}  // namespace sheaf
