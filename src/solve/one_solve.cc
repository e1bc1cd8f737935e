// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/one_solve.h"

#include <cmath>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "options/solve_options.h"
#include "scene/rigs.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

Error usage(const std::string& text) { return Error(ErrorCode::usage, text); }

double rms(double cost, std::size_t observations) {
  return observations > 0 ? std::sqrt(2 * cost / static_cast<double>(observations)) : 0;
}

}  // namespace

Result<void> check_options(const SolveOptions& options) {
  if (Result<void> fields = check_fields(options); !fields.ok()) return fields;
  if (options.trust_region == TrustRegion::dogleg && options.points != PointParametrisation::xyz &&
      options.points != PointParametrisation::automatic)
    return usage("the dogleg steps points by X, Y, Z: it takes no other parametrisation of points");
  return {};
}

Result<void> check_problem(const Problem& problem, const SolveOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid;
  for (std::uint32_t i : options.fixed.pose_ids)
    if (i >= problem.num_images())
      return usage("fixed pose " + std::to_string(i) + " is not one of the " +
                   std::to_string(problem.num_images()) + " images");
  for (std::uint32_t f : options.fixed.frame_ids)
    if (f >= problem.rigs.num_frames())
      return usage("fixed frame " + std::to_string(f) + " is not one of the " +
                   std::to_string(problem.rigs.num_frames()) + " frames");
  for (std::uint32_t s : options.fixed.sensor_ids)
    if (s >= problem.rigs.num_sensors())
      return usage("fixed sensor " + std::to_string(s) + " is not one of the " +
                   std::to_string(problem.rigs.num_sensors()) + " sensors");
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
  if (options.trust_region == TrustRegion::dogleg && !problem.terms.bounds.empty())
    return usage("the dogleg knows no bounds of parameters: Levenberg-Marquardt does");
  return {};
}

Result<void> solve_once(Problem& problem, SolveOptions& options, const Kernels& kernels,
                        Threads& threads, const Stopwatch& clock, KeptHome* kept,
                        Summary& summary) {
  place_images(problem);
  RunIdentity identity;
  if (!options.checkpoint.empty() || !options.resume.empty())
    identity = identity_of(problem, options, kernels.name);
  std::optional<Checkpoint> from;
  if (!options.resume.empty()) {
    Result<Checkpoint> read = read_checkpoint(options.resume, identity, problem);
    if (!read.ok()) return read.error();
    from = std::move(read).value();
  }
  summary.initial_terms = evaluate_terms(problem);
  const bool sigmas = !problem.observation_sigma.empty();
  PixelRms pixel_rms;
  if (sigmas && from) pixel_rms.before = evaluate(problem).rms_px;
  try {
    const SolveMeans means{kernels, threads, clock, identity, kept, pixel_rms};
    const Result<void> done = solve_in_attempts(problem, options, means, std::move(from), summary);
    if (!done.ok()) return done.error();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for this problem");
  }
  const std::size_t used = problem.num_observations() - summary.rejected_observations.size();
  summary.initial_rms_px = rms(summary.initial_plain_cost, used);
  summary.final_rms_px = rms(summary.final_plain_cost, used);
  summary.final_terms = evaluate_terms(problem);
  summary.at_bounds = bounds_reached(problem);
  if (sigmas) {
    // Without a home the state is the start's.
    const auto known = [&](double rms) { return rms >= 0 ? rms : evaluate(problem).rms_px; };
    summary.initial_rms_px = known(pixel_rms.before);
    summary.final_rms_px = known(pixel_rms.after);
  }
  return {};
}

}  // namespace sheaf
