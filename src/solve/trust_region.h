// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "linear/system.h"
#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/summary.h"

namespace sheaf {

/// The damping to start with. Measured on all problems at hand: up to 50 images 3e-5 to 6e-5 needs
/// the fewest steps on dubrovnik-16 and trafalgar-21 and still holds ladybug-49, which fails at
/// 1e-6 and crawls at 1e-3. Long scenes bend more: a street of 1723 images needs 1e-2 (from 5e-5 it
/// ends 13% higher), and photo collections of some hundred lose nothing by it.
double default_damping(std::size_t images);

/// Levenberg-Marquardt with gain-ratio control on any System. Fills the summary's iterations,
/// costs, termination and words; the best state is the system's held one.
/// `since_start` runs since set-up began (the time limit counts from there).
void minimize(System& system, const SolveOptions& options, const Stopwatch& since_start,
              Summary& summary);

}  // namespace sheaf
