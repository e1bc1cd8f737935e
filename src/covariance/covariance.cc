// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/covariance.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <new>

#include "covariance/inverse_normal.h"
#include "covariance/iterative_inverse.h"
#include "covariance/joint_functions.h"
#include "covariance/noise.h"
#include "covariance/telling.h"
#include "covariance/weak_directions.h"
#include "geometry/known_kinds.h"
#include "platform/cancel.h"
#include "platform/clock.h"
#include "platform/real_text.h"

namespace sheaf {
namespace {

Result<void> check(const Problem& problem, const CovarianceOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid;
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  if (problem.num_observations() == 0) return usage("the problem has no observations");
  if (!(options.sigma >= 0) || !std::isfinite(options.sigma))
    return usage("the sigma must be finite and not below 0");
  if (!(options.time_limit_s > 0)) return usage("the time limit must be above 0");
  for (const std::uint32_t p : options.point_ids)
    if (p >= problem.num_points())
      return usage("point " + std::to_string(p) + " is not one of the " +
                   std::to_string(problem.num_points()) + " points");
  const auto image_range = [&](std::uint32_t i) {
    return usage("image " + std::to_string(i) + " is not one of the " +
                 std::to_string(problem.num_images()) + " images");
  };
  for (const std::uint32_t i : options.image_ids)
    if (i >= problem.num_images()) return image_range(i);
  for (const std::array<std::uint32_t, 2>& pair : options.image_pairs)
    for (const std::uint32_t i : pair)
      if (i >= problem.num_images()) return image_range(i);
  if (options.gauge > Gauge::first_two || options.solver > CovarianceSolver::conjugate_gradients)
    return usage("the gauge or the solver is none that there is");
  if (!is_known(options.loss.kind)) return usage("the loss is none that there is");
  if (options.loss.kind != LossKind::none && !(options.loss.scale_px > 0))
    return usage("a covariance needs the loss's scale as the solve ended with it");
  return {};
}

/// Whether a few are named, each of which may be solved for.
bool is_named(const CovarianceOptions& options) {
  constexpr std::size_t kMany = 1000;
  return !options.image_ids.empty() &&
         options.image_ids.size() + options.point_ids.size() <= kMany &&
         (!options.points || !options.point_ids.empty()) && !options.observations;
}

/// Entries of the inverse by one way or the other, and what is asked for from them.
class Inverting {
 public:
  Inverting(const Problem& problem, const CovarianceOptions& options, NormalEquations& equations,
            const SceneGauge& gauge, const GaugeWeights& weights, Threads& threads, Covariance& out)
      : problem_(problem),
        options_(options),
        equations_(equations),
        gauge_(gauge),
        weights_(weights),
        threads_(threads),
        out_(out) {}

  Result<void> run() {
    const JointFunctions joint = joint_functions(problem_, equations_, options_);
    if (options_.solver != CovarianceSolver::conjugate_gradients) {
      const auto inverse =
          InverseNormal::make(problem_, equations_, gauge_, weights_, joint.functions,
                              options_.memory_limit_bytes, threads_);
      if (inverse.ok()) {
        tell(problem_, options_, equations_, *inverse.value(), inverse.value().get(), joint,
             threads_, out_);
        if (inverse.value()->ridged())
          notes_.push_back("the measurements leave more undetermined than the scene's freedoms");
        return {};
      }
      if (inverse.error().code() != ErrorCode::memory_limit ||
          options_.solver == CovarianceSolver::factor || !is_named(options_))
        return inverse.error();
      notes_.push_back(std::string(inverse.error().what()) +
                       ": what is named is solved for by conjugate gradients");
    }
    return iterate(joint);
  }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  Result<void> iterate(const JointFunctions& joint) {
    if (!is_named(options_))
      return Error(ErrorCode::usage,
                   "conjugate gradients tell of a few images and points, which must be named, and "
                   "not of observations");
    if (!weights_.of_points.empty())
      return Error(ErrorCode::usage,
                   "the gauge free-points needs the factor: state another gauge for conjugate "
                   "gradients");
    const IterativeInverse inverse(equations_, gauge_, weights_, joint.functions, threads_);
    tell(problem_, options_, equations_, inverse, nullptr, joint, threads_, out_);
    out_.solver = CovarianceSolver::conjugate_gradients;
    notes_.push_back("conjugate gradients took " + std::to_string(inverse.iterations()) +
                     " iterations");
    if (inverse.unfinished() > 0)
      notes_.push_back(std::to_string(inverse.unfinished()) +
                       " solves did not end: what they are of is told as infinite");
    return {};
  }

  const Problem& problem_;
  const CovarianceOptions& options_;
  NormalEquations& equations_;
  const SceneGauge& gauge_;
  const GaugeWeights& weights_;
  Threads& threads_;
  Covariance& out_;
  std::vector<std::string> notes_;
};

void add_words(const GaugeWeights& weights, const std::vector<std::string>& notes,
               Covariance& out) {
  if (out.deficit == 0) {
    out.words.push_back("the data fix the scene's place, turn and scale: no gauge is added");
  } else {
    std::string names;
    for (const std::string& name : out.freedoms) names += (names.empty() ? "" : ", ") + name;
    out.words.push_back(
        "the data leave " + std::to_string(out.deficit) + " of the scene's seven freedoms" +
        (out.deficit < 7 && !names.empty() ? " (" + names + ")" : "") + "; " + weights.words);
  }
  out.words.push_back("sigma of a residual " + few_digits(out.sigma, 6) +
                      (out.sigma_estimated ? ", from the residuals (redundancy " +
                                                 few_digits(out.redundancy, 6) + ")"
                                           : ", as stated"));
  out.words.insert(out.words.end(), notes.begin(), notes.end());
  if (out.undetermined_points > 0)
    out.words.push_back(std::to_string(out.undetermined_points) +
                        " points are not determined by their observations");
  constexpr std::size_t kMostSaid = 10;
  for (std::size_t k = 0; k < std::min(kMostSaid, out.weak.size()); ++k)
    out.words.push_back(out.weak[k].words);
  if (out.weak.size() > kMostSaid)
    out.words.push_back("and " + std::to_string(out.weak.size() - kMostSaid) +
                        " more parameters or pairs are not determined");
}

Result<Covariance> find(const Problem& given, const CovarianceOptions& options) {
  try {
    Problem placed;
    const Problem* problem = &given;
    if (!given.rigs.empty()) {
      placed = given;
      place_images(placed);
      problem = &placed;
    }
    Threads threads(options.threads);
    ScaledLoss loss{options.loss.kind, options.loss.scale_px, 1};
    if (loss.kind == LossKind::none) loss.scale_px = 1;
    NormalEquations equations(*problem, options.fixed, loss);
    const SceneGauge gauge(*problem, equations);
    const Gauge kind = options.gauge == Gauge::automatic && gauge.count() > 0 ? Gauge::free_centres
                                                                              : options.gauge;
    const Result<GaugeWeights> weights = gauge_weights(*problem, equations.blocks(), gauge, kind);
    if (!weights.ok()) return weights.error();
    Covariance out;
    out.gauge = gauge.count() == 0 ? Gauge::data : kind;
    out.deficit = static_cast<int>(gauge.count());
    out.freedoms = gauge.names();
    const auto seen = static_cast<std::uint64_t>(std::count_if(
        equations.squares().begin(), equations.squares().end(), [](double x) { return x > 0; }));
    out.unknowns = seen + 3 * equations.eliminated_points();
    out.rows = 2 * equations.moments().observations + equations.moments().terms;
    const Noise noise = noise_of(equations.moments(), loss, options.sigma,
                                 static_cast<double>(out.unknowns) - out.deficit);
    out.sigma = noise.sigma;
    out.sigma_estimated = noise.estimated;
    out.loss_factor = noise.factor;
    out.redundancy = noise.redundancy;
    Inverting inverting(*problem, options, equations, gauge, weights.value(), threads, out);
    if (const Result<void> done = inverting.run(); !done.ok()) return done.error();
    out.weak = weak_directions(*problem, out.lenses);
    add_words(weights.value(), inverting.notes(), out);
    return out;
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for the covariance");
  }
}

}  // namespace

Result<Covariance> covariance(const Problem& given, const CovarianceOptions& options) {
  const Stopwatch clock;
  if (const Result<void> good = check(given, options); !good.ok()) return good.error();
  const std::function<bool()> asked = [&] {
    return options.stop.stop_requested() || clock.seconds() >= options.time_limit_s;
  };
  Result<Covariance> found = Covariance();
  try {
    const CancelScope scope(asked);
    poll_cancelled();
    found = find(given, options);
  } catch (const Cancelled&) {
    found.value().ending =
        options.stop.stop_requested() ? CovarianceEnding::stopped : CovarianceEnding::time_limit;
  }
  if (found.ok()) found.value().seconds = clock.seconds();
  return found;
}

}  // namespace sheaf
