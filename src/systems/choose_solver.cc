// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/choose_solver.h"

#include <algorithm>
#include <string>

#include "lists/chunks.h"
#include "platform/memory.h"
#include "systems/forecast.h"
#include "systems/image_system.h"
#include "systems/lens_plan.h"

namespace sheaf {
namespace {

Plan asked_for(const WorkCounts& counts, CameraSolverKind kind) {
  const std::string asked = "as asked";
  const Plan plan = plan_solver(counts);
  switch (kind) {
    case CameraSolverKind::automatic:
      return plan;
    case CameraSolverKind::dense:
      return {SolverKind::dense, asked};
    case CameraSolverKind::sparse:
      return {SolverKind::sparse, asked};
    case CameraSolverKind::iterative_explicit:
      return {SolverKind::explicit_cg, asked};
    case CameraSolverKind::iterative_implicit:
      return {SolverKind::implicit_cg, asked};
    case CameraSolverKind::iterative:
      break;
  }
  return {cheaper_iterative(counts), asked + ", " + plan.reason};
}

/// A far point's parallax is lost among the roundings of its float products (docs/math.md, section
/// 7): measured, steps then fail that double makes.
bool loses_parallax(SolverKind kind, PointParametrisation points) {
  return kind == SolverKind::implicit_cg && points != PointParametrisation::xyz;
}

bool takes_mixed(SolverKind kind, const WorkCounts& counts, const SolveOptions& options) {
  // Rows through lenses are kept for it: memory that is given where it is asked for.
  if (counts.lenses && kind == SolverKind::implicit_cg)
    return options.precision == Precision::mixed;
  switch (options.precision) {
    case Precision::full:
      return false;
    case Precision::mixed:
      return has_mixed(kind);
    case Precision::automatic:
      break;
  }
  return prefers_mixed(kind) && !loses_parallax(kind, options.points);
}

/// An analysis, which may be large, is made again where it is needed.
std::shared_ptr<const WorkCounts> to_think_over(const WorkCounts& counts, SolverKind kind,
                                                const SolveOptions& options) {
  const bool iterative = kind == SolverKind::explicit_cg || kind == SolverKind::implicit_cg;
  if (options.solver != CameraSolverKind::automatic || options.memory_limit_bytes > 0 ||
      options.trust_region == TrustRegion::dogleg || !iterative)
    return nullptr;
  auto copy = std::make_shared<WorkCounts>(counts);
  copy->analysis = nullptr;
  return copy;
}

}  // namespace

Error over_memory_limit(std::uint64_t needed, std::uint64_t limit, const std::string& more) {
  return Error(ErrorCode::memory_limit, "the solver would need " + megabytes(needed) +
                                            ", over the limit of " + as_given(limit) +
                                            "; nothing was allocated" + more);
}

Result<Choice> choose_for_images(const Columns& columns, std::uint64_t batches,
                                 const SolveOptions& options, const MemoryHeld& held) {
  WorkCounts counts;
  counts.images = columns.num_images();
  counts.images_couple = false;
  const auto free_columns = static_cast<std::uint64_t>(columns.count);
  constexpr std::uint64_t kCode = 1000000;  // of the solver, mapped when it runs
  const std::uint64_t needed =
      held.resident_bytes + kCode + ImageSystem::bytes(counts.images, free_columns, batches);
  const Choice choice{plan_solver(counts), std::max(held.peak_bytes, needed)};
  if (options.memory_limit_bytes > 0 && choice.forecast_bytes > options.memory_limit_bytes)
    return over_memory_limit(choice.forecast_bytes, options.memory_limit_bytes);
  return choice;
}

Result<Choice> choose_solver(const WorkCounts& counts, const SolveOptions& options, int threads,
                             const MemoryHeld& held) {
  Choice choice{asked_for(counts, options.solver), 0};
  const bool forms_pairs =
      choice.plan.kind != SolverKind::blocks && choice.plan.kind != SolverKind::implicit_cg;
  if (forms_pairs && counts.longest_track > Chunks::kLongestTrack)
    return Error(ErrorCode::usage, "a point is seen " + std::to_string(counts.longest_track) +
                                       " times; solvers that form the camera matrix take at most " +
                                       std::to_string(Chunks::kLongestTrack) +
                                       ": use the implicit iterative solver");
  const auto forecast = [&](const Plan& plan) {
    // An analysis that is there already is counted with the solver that uses it.
    const std::uint64_t analysis = counts.analysis ? counts.analysis->bytes() : 0;
    return std::max(held.peak_bytes,
                    held.resident_bytes - analysis + forecast_bytes(counts, plan, threads));
  };
  choice.plan.mixed = takes_mixed(choice.plan.kind, counts, options);
  if (choice.plan.kind == SolverKind::sparse) choice.plan.analysis = counts.analysis;
  choice.forecast_bytes = forecast(choice.plan);
  choice.counts = to_think_over(counts, choice.plan.kind, options);
  if (options.memory_limit_bytes == 0 || choice.forecast_bytes <= options.memory_limit_bytes)
    return choice;
  Plan leanest{SolverKind::implicit_cg, "",
               !counts.lenses && takes_mixed(SolverKind::implicit_cg, counts, options)};
  const std::uint64_t lean = forecast(leanest);
  if (options.solver == CameraSolverKind::automatic && counts.images_couple &&
      !counts.only_formed && lean <= options.memory_limit_bytes) {
    leanest.reason = std::string(to_string(choice.plan.kind)) + " would need " +
                     megabytes(choice.forecast_bytes) + ", over the limit of " +
                     as_given(options.memory_limit_bytes);
    choice.plan = leanest;
    choice.forecast_bytes = lean;
    return choice;
  }
  return over_memory_limit(
      choice.forecast_bytes, options.memory_limit_bytes,
      lean < choice.forecast_bytes && !counts.only_formed
          ? " (the leanest solver, iterative-implicit, needs " + megabytes(lean) + ")"
          : "");
}

Result<LensChoice> choose_for_lenses(const Arrangement& arranged, const SolveOptions& options,
                                     Threads& threads) {
  const bool held = options.fixed.points;
  Clusters clusters;
  WorkCounts counts = estimate_lens_work(arranged, held, clusters, threads);
  counts.weighted = options.loss.kind != LossKind::none || arranged.batches.weighted();
  counts.dogleg = options.trust_region == TrustRegion::dogleg;
  const Batches& batches = arranged.batches;
  const LensTracks& tracks = arranged.tracks;
  SolveOptions implicit = options;
  implicit.solver = CameraSolverKind::iterative_implicit;
  std::string reason = asked_for(counts, options.solver).reason;
  LensChoice out;
  bool forms = asked_for(counts, options.solver).kind != SolverKind::implicit_cg;
  if (forms && !held && options.solver == CameraSolverKind::automatic) {
    // Lists of pairs that the limit leaves no room for are not cut.
    WorkCounts formed = counts;
    formed.only_formed = true;
    const MemoryHeld memory{resident_bytes(), peak_resident_bytes()};
    const Result<Choice> fits = choose_solver(formed, options, threads.count(), memory);
    forms = fits.ok();
    if (!forms) reason = fits.error().what();
  }
  // Points that are held make no pairs: to form the matrix is then next to nothing.
  if (held || forms) {
    out.chunks =
        cut_lens_chunks(batches, tracks, held ? LensLists::own_lens : LensLists::pairs, threads);
    counts = count_lens_work(arranged, out.chunks, counts);
    const MemoryHeld memory{resident_bytes(), peak_resident_bytes()};
    Result<Choice> formed = choose_solver(counts, options, threads.count(), memory);
    if (formed.ok()) {
      out.choice = std::move(formed).value();
      out.choice.plan.clusters = std::move(clusters);
      return out;
    }
    if (options.solver != CameraSolverKind::automatic) return formed.error();
    reason = formed.error().what();
  }
  out.chunks = {};
  const MemoryHeld memory{resident_bytes(), peak_resident_bytes()};
  Result<Choice> last = choose_solver(counts, implicit, threads.count(), memory);
  if (!last.ok()) return last.error();
  out.chunks = cut_lens_chunks(batches, tracks, LensLists::diagonal, threads);
  out.choice = std::move(last).value();
  out.choice.plan.reason = std::move(reason);
  out.choice.plan.clusters = std::move(clusters);
  return out;
}

}  // namespace sheaf
