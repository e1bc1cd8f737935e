// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "report/errors.h"

namespace sheaf {

/// (seconds since the solver started to build its problem, cost of the state held), after the start
/// was evaluated and after every step, rejected ones included.
using CostTrace = std::vector<std::pair<double, double>>;

/// One solver on one problem.
struct SolverRun {
  std::string solver, config;
  std::string failed;  ///< why there is no result; empty: it ran
  CostTrace trace;
  double setup_s = 0, total_s = 0;    ///< without reading and writing
  double cpu_percent = 0;             ///< of one core, while set up and solving
  std::uint64_t peak_bytes = 0;       ///< of the process
  double final_cost = 0;              ///< as the solver has it
  double final_cost_independent = 0;  ///< of the state it wrote, evaluated by other code
  std::optional<StateErrors> errors;  ///< against a reference
  int turn = 0;                       ///< which of several runs

  bool ran() const { return failed.empty(); }
  /// A solver's own final cost may differ from the independent one by the order of its sums only.
  bool agrees() const;
};

/// Steps of a trace: one after which the cost is what it was counts as rejected. What a solver
/// tries within one of its steps does not show.
struct StepTimes {
  int accepted = 0, rejected = 0;
  double accepted_s = 0, rejected_s = 0;  ///< mean seconds of one; 0 for none
  double step_s = 0;                      ///< of any
};
StepTimes step_times(const CostTrace& trace);

/// A trace that a solver tells may have the cost of a state that it tried and refused: what was
/// held then is the state before.
CostTrace held_costs(const CostTrace& told);

/// Seconds until the cost is at or below `cost`, or nothing.
std::optional<double> time_to(const CostTrace& trace, double cost);

/// The least independent cost of those that ran; infinite when none did.
double best_cost(const std::vector<SolverRun>& runs);

/// "points", "poses", "f", "k1" or "k2": the first of what is to be held that is not where it was,
/// to 1e-9 of its size (a peer may write a rotation in other words); "" when all is.
std::string what_moved(const Problem& before, const Problem& after, const Fixed& fixed);

/// For each (solver, config), in order of appearance, the run of median total time; where none of
/// its runs has a result, the first. Indices into runs.
std::vector<std::size_t> median_runs(const std::vector<SolverRun>& runs);

}  // namespace sheaf
