// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/solve.h"

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "options/solve_options.h"
#include "platform/clock.h"
#include "platform/memory.h"
#include "scene/behind.h"
#include "solve/loss_rounds.h"
#include "solve/trust_region.h"
#include "systems/build.h"

namespace sheaf {
namespace {

Result<void> check(const Problem& problem, const SolveOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid;
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  for (std::uint32_t i : options.fixed.pose_ids)
    if (i >= problem.num_images())
      return usage("fixed pose " + std::to_string(i) + " is not one of the " +
                   std::to_string(problem.num_images()) + " images");
  for (const auto* ids : {&options.fixed.camera_ids, &options.fixed.k1_ids, &options.fixed.k2_ids})
    for (std::uint32_t i : *ids)
      if (i >= problem.cameras.size())
        return usage("fixed camera " + std::to_string(i) + " is not one of the " +
                     std::to_string(problem.cameras.size()) + " cameras");
  if (const std::size_t sets = options.fixed.parameters.size();
      sets > 0 && sets != problem.cameras.size())
    return usage("fixed parameters are given for " + std::to_string(sets) + " of " +
                 std::to_string(problem.cameras.size()) + " cameras");
  if (problem.num_observations() == 0) return usage("the problem has no observations");
  if (Result<void> fields = check_fields(options); !fields.ok()) return fields;
  if (options.trust_region == TrustRegion::dogleg && options.points != PointParametrisation::xyz)
    return usage("the dogleg steps points by X, Y, Z: it takes no other parametrisation of points");
  return {};
}

void tell(const Choice& choice, const SolveOptions& options, const Kernels& kernels,
          const Threads& threads, Summary& summary) {
  summary.solver = to_string(choice.plan.kind);
  summary.solver_reason = choice.plan.reason;
  summary.precision = choice.plan.mixed ? "mixed" : "double";
  summary.forecast_bytes = choice.forecast_bytes;
  summary.simd = kernels.name;
  summary.loss = options.loss.kind;
  summary.threads = threads.count();
  if (options.on_plan) options.on_plan(summary);
}

/// Observations to leave out: 1 for each.
std::vector<std::uint8_t> held_out(const Problem& problem, const SolveOptions& options,
                                   Threads& threads, Summary& summary) {
  std::vector<std::uint8_t> skip;
  if (options.cheirality != Cheirality::hold_out) return skip;
  summary.rejected_observations = behind_camera(problem, threads);
  skip.assign(problem.num_observations(), 0);
  for (std::uint64_t i : summary.rejected_observations) skip[i] = 1;
  return skip;
}

/// Builds a system of the problem, refines it and stores it; what went wrong, if anything.
Result<void> refine(Problem& problem, SolveOptions options, const Kernels& kernels,
                    const Stopwatch& clock, Summary& summary) {
  Threads threads(options.threads);
  const std::vector<std::uint8_t> skip = held_out(problem, options, threads, summary);
  Result<Build> planned = Build::plan(problem, options, skip, kernels, threads);
  if (!planned.ok()) return planned.error();
  Build& build = planned.value();
  tell(build.choice(), options, kernels, threads, summary);
  bool behind_after = false;
  {
    if (build.lends()) summary.behind_camera_before = behind_camera(problem, threads);
    std::optional<LentObservations> lent;
    if (build.lends()) build.lend(problem, lent);
    const std::unique_ptr<Home> home = build.make_home(problem);
    if (!build.lends() && home->count_behind() > 0)
      summary.behind_camera_before = behind_camera(problem, threads);
    summary.setup_s = clock.seconds();
    if (options.initial_damping == 0)
      options.initial_damping = default_damping(problem.num_images());
    minimize_in_rounds(*home, options, clock, summary);
    build.store(*home, problem);
    behind_after = home->count_behind() > 0;
  }
  summary.solve_s = clock.seconds() - summary.setup_s;
  if (behind_after) summary.behind_camera_after = behind_camera(problem, threads);
  return {};
}

double rms(double cost, std::size_t observations) {
  return observations > 0 ? std::sqrt(2 * cost / static_cast<double>(observations)) : 0;
}

}  // namespace

Result<Summary> try_solve(Problem& problem, const SolveOptions& options) {
  const Stopwatch clock;
  if (Result<void> valid = check(problem, options); !valid.ok()) return valid.error();
  Result<const Kernels*> kernels = choose_kernels(options.simd);
  if (!kernels.ok()) return kernels.error();

  Summary summary;
  try {
    const Result<void> done = refine(problem, options, *kernels.value(), clock, summary);
    if (!done.ok()) return done.error();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for this problem");
  }
  const std::size_t used = problem.num_observations() - summary.rejected_observations.size();
  summary.initial_rms_px = rms(summary.initial_plain_cost, used);
  summary.final_rms_px = rms(summary.final_plain_cost, used);
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
  }
  return "no_usable_step";
}

}  // namespace sheaf
