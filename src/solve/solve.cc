// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/solve.h"

#include "solve/one_solve.h"
#include "systems/build.h"

namespace sheaf {

Result<Summary> try_solve(Problem& problem, const SolveOptions& options) {
  const Stopwatch clock;
  if (Result<void> valid = check_problem(problem, options); !valid.ok()) return valid.error();
  if (Result<void> valid = check_options(options); !valid.ok()) return valid.error();
  Result<const Kernels*> kernels = choose_kernels(options.simd);
  if (!kernels.ok()) return kernels.error();
  Summary summary;
  SolveOptions own = options;
  try {
    Threads threads(options.threads);
    const Result<void> done =
        solve_once(problem, own, *kernels.value(), threads, clock, nullptr, summary);
    if (!done.ok()) return done.error();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for this problem");
  }
  return summary;
}

Summary solve(Problem& problem, const SolveOptions& options) {
  return try_solve(problem, options).value();
}

const char* to_string(Termination termination) {
  switch (termination) {
    case Termination::cost_converged:
      return "cost_converged";
    case Termination::gradient_converged:
      return "gradient_converged";
    case Termination::step_converged:
      return "step_converged";
    case Termination::max_iterations:
      return "max_iterations";
    case Termination::time_limit:
      return "time_limit";
    case Termination::stopped:
      return "stopped";
    case Termination::no_usable_step:
      return "no_usable_step";
    case Termination::nothing_free:
      return "nothing_free";
    case Termination::zero_weights:
      return "zero_weights";
    case Termination::drowned:
      return "drowned";
  }
  return "no_usable_step";
}

}  // namespace sheaf
