// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/solve.h"
#include "solve/checkpoint_file.h"
#include "solve/trust_region.h"
#include "starts/sights.h"
#include "systems/home.h"

namespace sheaf {

inline constexpr CheckpointKind kSolveCheckpoint{"SHEAFCKP", "solve", 1};

/// A run before one of its steps: with the same problem and options another process goes on from it
/// to the bits of the run that was never stopped.
struct Checkpoint {
  RunIdentity identity;
  Summary summary;
  LoopHistory loop;
  RunProgress progress;
  HomeHistory home;
  Estimate attempt_start;
  // The state, to the bit: the home's cameras, and points as in a problem.
  CameraState cameras;
  std::vector<double> points;
  // What a run changes of its own options.
  int recoveries = 0;
  CameraSolverKind solver = CameraSolverKind::automatic;
  double initial_damping = 0;
};

/// With the fingerprint of measurements, state, rigs, terms and what is held.
RunIdentity identity_of(const Problem& problem, const SolveOptions& options,
                        const std::string& simd);

/// Written beside and renamed. Errors: unwritable_output.
Result<void> write_checkpoint(const Checkpoint& checkpoint, const std::string& path);

/// Errors: unreadable_input for what is no whole checkpoint of this version, usage, naming it,
/// where problem or options are others.
Result<Checkpoint> read_checkpoint(const std::string& path, const RunIdentity& expected,
                                   const Problem& problem);

}  // namespace sheaf
