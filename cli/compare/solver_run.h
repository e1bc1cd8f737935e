// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "compare/solver_programs.h"
#include "options/refinement.h"
#include "report/comparison.h"
#include "sheaf/io.h"
#include "sheaf/stop.h"

namespace sheaf {

/// When each solver ends, and what it holds.
struct RunLimits {
  int max_iterations = 50;
  double time_s = 60;
  /// The one stopping rule of all: two accepted steps in a row that decrease the cost by less than
  /// this part of it.
  double tolerance = 1e-12;
  RefinementArguments refinement;  ///< as in `sheaf solve`
};

/// What the runs of one comparison have in common. All read the same plain BAL text or, for a
/// model, the same binary COLMAP folder; what is not that already is written out, in the scratch
/// folder.
struct RunSetting {
  RunSetting(const std::string& path, const InputFile& input, const Problem* reference, int threads,
             const RunLimits& limits, const std::filesystem::path& scratch, StopToken stop);

  const Problem& problem;
  const Problem* reference;  ///< or null
  std::string path;          ///< of plain text, or of the folder
  bool model = false;        ///< a COLMAP model with its own lenses, not a BAL file
  int threads;
  RunLimits limits;
  double kill_after_s;  ///< reading and writing included
  std::filesystem::path scratch;
  StopToken stop;
};

/// Runs one solver in a process of its own and evaluates what it wrote. Whatever goes wrong with it
/// is said in the run's `failed`.
SolverRun run_solver(const SolverProgram& solver, const RunSetting& setting);

/// The file's name without its folders.
std::string input_name(const std::string& path);

}  // namespace sheaf
