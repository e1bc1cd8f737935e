// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/solve.h"

#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "eliminate/kernel_table.h"
#include "lists/lent_observations.h"
#include "platform/clock.h"
#include "platform/memory.h"
#include "scene/behind.h"
#include "solve/loss_rounds.h"
#include "solve/trust_region.h"
#include "systems/bal_view.h"
#include "systems/bundle_system.h"
#include "systems/choose_solver.h"
#include "systems/image_system.h"
#include "systems/lens_system.h"

namespace sheaf {
namespace {

const char* simd_name(Simd simd) {
  switch (simd) {
    case Simd::scalar:
      return "scalar";
    case Simd::sse4:
      return "sse4";
    case Simd::avx2:
      return "avx2";
    case Simd::avx512:
      return "avx512";
    case Simd::best:
      break;
  }
  return "";
}

Result<const Kernels*> choose_kernels(Simd simd) {
  const auto available = available_kernels();
  if (simd == Simd::best) return available.front();
  std::string names;
  for (const Kernels* kernels : available) {
    if (std::string(kernels->name) == simd_name(simd)) return kernels;
    names += std::string(names.empty() ? "" : ", ") + kernels->name;
  }
  return Error(ErrorCode::usage, std::string("this machine cannot run the instruction set ") +
                                     simd_name(simd) + "; it can run: " + names);
}

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
  if (options.max_iterations < 0) return usage("max_iterations is negative");
  if (options.inner_iterations < 0) return usage("inner_iterations is negative");
  if (!(options.tolerance >= 0)) return usage("tolerance is negative or not a number");
  if (!(options.gradient_tolerance >= 0))
    return usage("gradient_tolerance is negative or not a number");
  if (!(options.time_limit_s >= 0)) return usage("time_limit_s is negative or not a number");
  if (!(options.initial_damping >= 0)) return usage("initial_damping is negative or not a number");
  if (options.threads < 0) return usage("threads is negative");
  if (options.trust_region == TrustRegion::dogleg && options.points != PointParametrisation::xyz)
    return usage("the dogleg steps points by X, Y, Z: it takes no other parametrisation of points");
  const Loss& loss = options.loss;
  if (!(loss.scale_px >= 0 && std::isfinite(loss.scale_px)))
    return usage("the scale of the loss is negative or not finite");
  if (loss.graduated && is_convex(loss.kind))
    return usage(std::string("the loss ") + to_string(loss.kind) +
                 " is convex: there is nothing to graduate");
  return {};
}

ChartBase chart_base(PointParametrisation points) {
  switch (points) {
    case PointParametrisation::xyz:
      return ChartBase::none;
    case PointParametrisation::homogeneous:
      return ChartBase::origin;
    case PointParametrisation::inverse_depth:
      return ChartBase::host;
  }
  return ChartBase::none;
}

/// A few hundred megabytes are worth a pass over the observations at the end.
bool lends_observations(const Problem& problem, const Batches& batches, const SolveOptions& options,
                        Threads& threads) {
  constexpr std::size_t kWorthLending = 4000000;
  return options.lend_observations && problem.num_observations() >= kWorthLending &&
         LentObservations::possible(problem, batches, threads);
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

/// Refines what is set up, and stores it.
template <class Home>
void run(Home& system, Problem& problem, SolveOptions options, const Stopwatch& clock,
         Summary& summary) {
  summary.setup_s = clock.seconds();
  if (options.initial_damping == 0) options.initial_damping = default_damping(problem.num_images());
  minimize_in_rounds(system, options, clock, summary);
  system.store(problem);
}

/// Points held, no lens shared: images by themselves.
Result<void> refine_images(Problem& problem, const SolveOptions& options, const Kernels& kernels,
                           const std::vector<std::uint8_t>& skip, Columns columns, Threads& threads,
                           const Stopwatch& clock, Summary& summary) {
  const Result<Choice> choice = choose_for_images(columns, count_image_batches(problem), options,
                                                  {resident_bytes(), peak_resident_bytes()});
  if (!choice.ok()) return choice.error();
  tell(choice.value(), options, kernels, threads, summary);
  ImageSystem system(problem, arrange_by_image(problem, skip), std::move(columns),
                     options.cheirality != Cheirality::formula, image_kernels(kernels.name),
                     threads);
  if (system.count_behind() > 0) summary.behind_camera_before = behind_camera(problem, threads);
  run(system, problem, options, clock, summary);
  summary.solve_s = clock.seconds() - summary.setup_s;
  if (system.count_behind() > 0) summary.behind_camera_after = behind_camera(problem, threads);
  return {};
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

/// Lenses of any model.
Result<void> refine_lenses(Problem& problem, const SolveOptions& options, const Kernels& kernels,
                           const Stopwatch& clock, Summary& summary) {
  const auto refused = [](const char* what) {
    return Error(ErrorCode::usage,
                 std::string(what) +
                     " is for BAL, SIMPLE_PINHOLE, SIMPLE_RADIAL and RADIAL cameras with their "
                     "principal points held");
  };
  if (options.trust_region == TrustRegion::dogleg) return refused("the dogleg");
  if (options.points != PointParametrisation::xyz)
    return refused("a parametrisation of points other than X, Y, Z");
  Threads threads(options.threads);
  const std::vector<std::uint8_t> skip = held_out(problem, options, threads, summary);
  const Result<LensArrangement> arranged =
      arrange_with_lenses(problem, options.fixed, skip, threads);
  if (!arranged.ok()) return arranged.error();
  Result<LensChoice> chosen = choose_for_lenses(arranged.value(), options, threads);
  if (!chosen.ok()) return chosen.error();
  const Choice& choice = chosen.value().choice;
  tell(choice, options, kernels, threads, summary);
  const LensRules rules{options.fixed.points, options.cheirality != Cheirality::formula,
                        options.inner_iterations};
  LensSystem system(problem, arranged.value(), std::move(chosen.value().chunks), rules, choice.plan,
                    kernels, threads);
  summary.behind_camera_before = behind_camera(problem, threads);
  run(system, problem, options, clock, summary);
  summary.solve_s = clock.seconds() - summary.setup_s;
  summary.behind_camera_after = behind_camera(problem, threads);
  return {};
}

/// Arranges the problem, chooses the solver and refines; what went wrong, if anything.
Result<void> refine(Problem& problem, const SolveOptions& options, const Kernels& kernels,
                    const Stopwatch& clock, Summary& summary) {
  Threads threads(options.threads);
  const std::vector<std::uint8_t> skip = held_out(problem, options, threads, summary);
  Columns columns = number_columns(problem, options.fixed);
  const bool only_images = options.fixed.points && !columns.lens_shared &&
                           options.trust_region == TrustRegion::lm &&
                           options.solver == CameraSolverKind::automatic;
  if (only_images)
    return refine_images(problem, options, kernels, skip, std::move(columns), threads, clock,
                         summary);
  const Batches batches = arrange(problem, skip, threads);
  Clusters clusters;
  WorkCounts counts = count_work(batches, columns, options.fixed.points, clusters, threads);
  counts.weighted = options.loss.kind != LossKind::none;
  counts.dogleg = options.trust_region == TrustRegion::dogleg;
  const bool lends = lends_observations(problem, batches, options, threads);
  const std::uint64_t lent_bytes = lends ? LentObservations::bytes(problem) : 0;
  Result<Choice> choice = choose_solver(counts, options, threads.count(),
                                        {resident_bytes() - lent_bytes, peak_resident_bytes()});
  if (!choice.ok()) return choice.error();
  choice.value().plan.clusters = std::move(clusters);
  tell(choice.value(), options, kernels, threads, summary);

  bool behind_after = false;
  {
    std::optional<LentObservations> lent;
    if (lends) {
      summary.behind_camera_before = behind_camera(problem, threads);
      lent.emplace(problem, batches, threads);
    }
    const PointRules rules{options.fixed.points, options.cheirality != Cheirality::formula,
                           options.inner_iterations, chart_base(options.points)};
    BundleSystem system(problem, batches, std::move(columns), rules, choice.value().plan, kernels,
                        threads);
    if (!lends && system.count_behind() > 0)
      summary.behind_camera_before = behind_camera(problem, threads);
    run(system, problem, options, clock, summary);
    behind_after = system.count_behind() > 0;
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
    Result<void> done;
    if (BalView::serves(problem, options.fixed)) {
      SolveOptions resolved = options;
      const BalView view(problem, resolved.fixed);
      done = refine(problem, resolved, *kernels.value(), clock, summary);
    } else {
      done = refine_lenses(problem, options, *kernels.value(), clock, summary);
    }
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
