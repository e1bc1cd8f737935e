// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <optional>

#include "eliminate/kernels.h"
#include "lists/lent_observations.h"
#include "platform/clock.h"
#include "platform/parallel.h"
#include "sheaf/solve.h"
#include "solve/checkpoint.h"
#include "solve/structure.h"
#include "systems/build.h"

namespace sheaf {

/// What one solve leaves to the next one of the same structure and options: where everything
/// stands, and the memory of it.
struct KeptHome {
  std::optional<Structure> structure;  ///< that the others are made for; nothing: there are none
  std::optional<Build> build;
  std::optional<LentObservations> lent;  ///< until the home is gone
  std::unique_ptr<Home> home;
  bool used = false;  ///< by the last solve

  void forget() {
    structure.reset();
    home.reset();
    lent.reset();
    build.reset();
  }
};

/// Of a problem with sigmas, whose costs are not of pixels: the root of its mean |r|^2; not a
/// number where no home was there to tell.
struct PixelRms {
  double before = std::numeric_limits<double>::quiet_NaN();
  double after = std::numeric_limits<double>::quiet_NaN();
};

/// What a solve is done with.
struct SolveMeans {
  const Kernels& kernels;
  Threads& threads;
  const Stopwatch& clock;  ///< since set-up began
  const RunIdentity& identity;
  KeptHome* kept;  ///< null: nothing is kept
  PixelRms& pixel_rms;
};

/// Refines a valid problem in attempts, each with a home of its own: where an early step went wrong
/// or another camera solver is to go on, there is another one. from: goes on from there.
/// The options come out with what the run has changed of them.
Result<void> solve_in_attempts(Problem& problem, SolveOptions& options, const SolveMeans& means,
                               std::optional<Checkpoint> from, Summary& summary);

}  // namespace sheaf
