// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "linear/system.h"
#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/summary.h"

namespace sheaf {

/// The damping to start with. Measured on all problems at hand: up to 50 images 1.5e-5 to 6e-5
/// needs the fewest steps on dubrovnik-16 and trafalgar-21 and holds ladybug-49, which fails at
/// 5e-6. Long scenes bend more: streets of 138 and 1723 images reach lower minima from 1e-2 (by 3%
/// and 1%) than from 1e-3, and photo collections of some hundred images pay a step for it.
double default_damping(std::size_t images);

/// Levenberg-Marquardt with gain-ratio control on any System, with one loss. Adds to the summary's
/// iterations, and sets costs, termination and words; the best state is the system's held one.
/// An infinite tolerance ends it after one accepted step.
/// `since_start` runs since set-up began (the time limit counts from there).
void minimize(System& system, const ScaledLoss& loss, const SolveOptions& options,
              const Stopwatch& since_start, Summary& summary);

}  // namespace sheaf
