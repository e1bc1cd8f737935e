// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "eliminate/kernel_table.h"
#include "options/photometric_options.h"
#include "platform/clock.h"
#include "platform/memory.h"
#include "sheaf/solve.h"
#include "solve/patch_anchor.h"
#include "solve/patch_level.h"
#include "solve/patch_statistics.h"
#include "solve/photometric_checkpoint.h"
#include "solve/photometric_forecast.h"
#include "solve/photometric_rules.h"
#include "solve/trust_region.h"
#include "systems/choose_solver.h"
#include "systems/photometric_system.h"

namespace sheaf {
namespace {

class Refinement {
 public:
  Refinement(PhotometricProblem& problem, const PhotometricOptions& options, const Pattern& pattern)
      : problem_(problem),
        options_(options),
        pattern_(pattern),
        threads_(options.threads),
        kernels_(*available_kernels().front()),
        identity_(keeps_checkpoints() ? identity_of(problem, options, kernels_.name)
                                      : RunIdentity{}),
        rays_(uses_rays(problem, options)),
        measurements_(measurements_of(problem, options)),
        state_(state_of(problem, rays_)) {}

  /// The process's peak resident size.
  std::uint64_t forecast() {
    const std::uint64_t more = forecast_photometric(problem_, options_, pattern_, threads_.count());
    return summary_.solve.forecast_bytes = std::max(peak_resident_bytes(), resident_bytes() + more);
  }

  Result<PhotometricSummary> run() {
    if (!options_.resume.empty()) {
      Result<PhotometricCheckpoint> from =
          read_checkpoint(options_.resume, identity_, problem_, options_.levels);
      if (!from.ok()) return from.error();
      from_ = std::move(from).value();
    }
    Summary& solve = summary_.solve;
    solve.simd = kernels_.name;
    solve.threads = threads_.count();
    solve.loss = options_.loss.kind;
    const PatchScene finest = scene_of_level(problem_, options_, pattern_, 0);
    const std::vector<Sight> seen = sights_in(finest);
    summary_.patches_total = all_sights(problem_, rays_).size();
    summary_.patches_visible = seen.size();
    if (seen.empty() && measurements_.empty()) return unseen();
    PatchStatistics statistics(finest, seen);
    statistics.measure_before(state_);
    summary_.measurements = measurements_.size();
    summary_.initial_rms_px = rms_of(measurements_, finest, state_);
    if (from_) take_up();
    for (int level = from_ ? from_->round.level : options_.levels - 1; level > 0; --level)
      if (!refine(scene_of_level(problem_, options_, pattern_, level), level)) break;
    if (options_.levels == 1 || from_ || converged()) refine(finest, 0);
    if (foreign_) return senseless_checkpoint(options_.resume);
    solve.solve_s = clock_.seconds() - solve.setup_s;
    statistics.measure_after(state_);
    summary_.final_rms_px = rms_of(measurements_, finest, state_);
    report(statistics);
    store_state(state_, rays_, problem_);
    return summary_;
  }

 private:
  bool keeps_checkpoints() const {
    return !options_.checkpoint.empty() || !options_.resume.empty();
  }

  /// What another process knew, but for the state, which descend() takes.
  void take_up() {
    const std::string simd = summary_.solve.simd;
    const std::uint64_t forecast = summary_.solve.forecast_bytes;
    summary_.solve = std::move(from_->solve);
    summary_.solve.simd = simd;
    summary_.solve.threads = threads_.count();
    summary_.solve.forecast_bytes = forecast;
    summary_.solve.resumed_after = summary_.solve.iterations.back().index;
    summary_.anchor_sigma_grey = from_->round.anchor_sigma_grey;
    brightness_fitted_ = from_->brightness_fitted;
    sigma_ = from_->sigma_grey;
    progress_ = from_->progress;
    progress_.resumes = true;
  }

  /// A checkpoint, where it is time for one. A run that is to stop leaves where it stands.
  void write_down(const PhotometricSystem& system) {
    if (!history_ || !times_.is_due(options_, clock_)) return;
    Summary& solve = summary_.solve;
    times_.note(write_checkpoint({identity_, solve, *history_, progress_, system.history(), round_,
                                  system.state(), system.leaving(), brightness_fitted_, sigma_},
                                 options_.checkpoint),
                clock_, solve);
  }

  /// Nothing says where anything is.
  PhotometricSummary unseen() {
    Summary& solve = summary_.solve;
    solve.termination = Termination::no_usable_step;
    solve.words = "none of the " + std::to_string(summary_.patches_total) +
                  " patches is seen in any image: the state is as it was; are poses and depths of "
                  "these images, in this unit?";
    solve.iterations.push_back({});
    solve.rounds.push_back({});
    return summary_;
  }

  PhotometricRules rules() const {
    PhotometricRules out;
    out.poses_held = options_.fix_poses;
    out.points_held = options_.fix_points;
    out.brightness = options_.affine_brightness;
    out.first_brightness_held = rays_;
    out.prior_a = options_.prior_a;
    out.prior_b = options_.prior_b;
    out.loss_per_patch = options_.loss_per_patch;
    out.leaving_is_free = options_.leaving == Leaving::free;
    out.exact_rows = options_.rows == PatchRows::exact;
    out.solver = options_.solver;
    return out;
  }

  SolveOptions loop_options(int level) const {
    SolveOptions out;
    out.max_iterations = options_.max_iterations;
    out.tolerance = level > 0 ? std::numeric_limits<double>::infinity() : options_.tolerance;
    out.initial_damping = options_.initial_damping > 0 ? options_.initial_damping
                                                       : default_damping(problem_.poses.size());
    if (summary_.solve.iterations.size() > 1)
      out.initial_damping = std::max(out.initial_damping, summary_.solve.iterations.back().damping);
    out.time_limit_s = options_.time_limit_s;
    out.on_iteration = options_.on_iteration;
    out.stop = options_.stop;
    return out;
  }

  std::vector<Sight> sights_in(const PatchScene& scene) const {
    std::vector<Sight> out;
    for (const Sight& sight : all_sights(problem_, rays_))
      if (is_seen(scene, state_, sight)) out.push_back(sight);
    return out;
  }

  /// Those that count in a round.
  std::vector<Sight> sights_of_round(const PatchScene& scene) const {
    if (options_.leaving == Leaving::free) return all_sights(problem_, rays_);
    std::vector<Sight> out = sights_in(scene);
    if (options_.min_zncc > -1)
      std::erase_if(out, [&](const Sight& sight) {
        return correlation(scene, state_, sight) < options_.min_zncc;
      });
    return out;
  }

  /// Rounds of steps on one level, each with the patches seen at its start, until these stay the
  /// same. False when the run is to end.
  bool refine(const PatchScene& scene, int level) {
    for (const ScaledLoss loss = begin_level(scene, level); descend(scene, loss); ++round_.number) {
      if (round_.number >= options_.rounds) return true;
      std::vector<Sight> next = sights_of_round(scene);
      const double next_sigma = sigma_of_anchor(scene, next);
      if (!differ(round_.sights, next) && !differ(round_.anchor_sigma_grey, next_sigma))
        return true;
      round_.sights = std::move(next);
      round_.anchor_sigma_grey = next_sigma;
    }
    return false;
  }

  /// Its first round, or the one that another process was in.
  ScaledLoss begin_level(const PatchScene& scene, int level) {
    if (from_) {
      round_ = std::move(from_->round);
      return scaled_for(options_, pattern_, sigma_);
    }
    round_ = {level, 1, sights_of_round(scene), 0, {}};
    const ScaledLoss loss = scaled_loss(scene, round_.sights);
    round_.anchor_sigma_grey = sigma_of_anchor(scene, round_.sights);
    return loss;
  }

  /// A pixel's standard deviation as a measured position is weighed against it. Unlike the loss's
  /// scale it follows the rounds: from afar the anchor leads, and then the pixels do.
  double sigma_of_anchor(const PatchScene& scene, const std::vector<Sight>& sights) {
    if (measurements_.empty()) return 0;
    PhotometricSystem system(scene, state_, sights, rules(), kernels_, threads_);
    summary_.anchor_sigma_grey =
        std::max(kLeastSigma, kSigmaPerMedian * system.residual_scale(0.5));
    return summary_.anchor_sigma_grey;
  }
  static bool differ(double sigma, double next) { return std::abs(next - sigma) > 0.05 * sigma; }

  /// By more than one patch in fifty.
  static bool differ(const std::vector<Sight>& a, const std::vector<Sight>& b) {
    const auto before = [](const Sight& x, const Sight& y) {
      return x.point != y.point ? x.point < y.point : x.image < y.image;
    };
    std::vector<Sight> changed;
    std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(),
                                  std::back_inserter(changed), before);
    return 50 * changed.size() > a.size();
  }

  /// An automatic scale follows from what is left once brightness is fitted with poses and points
  /// held.
  ScaledLoss scaled_loss(const PatchScene& scene, const std::vector<Sight>& sights) {
    sigma_ = 0;
    if (options_.loss.kind == LossKind::none || options_.loss.scale_px != kAutomaticScale)
      return scaled_for(options_, pattern_, 0);
    PhotometricRules held = rules();
    held.poses_held = held.points_held = true;
    PhotometricSystem system(scene, state_, sights, held, kernels_, threads_);
    if (options_.affine_brightness && !brightness_fitted_) {
      SolveOptions steps;
      steps.max_iterations = 10;
      steps.tolerance = 1e-4;
      Summary unseen;
      minimize(system, {LossKind::huber, kFirstScale}, steps, clock_, unseen);
      state_ = system.state();
      brightness_fitted_ = true;
    }
    sigma_ = std::max(kLeastSigma, kSigmaPerMedian * system.residual_scale(0.5));
    return scaled_for(options_, pattern_, sigma_);
  }

  /// Steps until they converge; false where they did not.
  bool descend(const PatchScene& scene, const ScaledLoss& loss) {
    Summary& solve = summary_.solve;
    if (from_)
      state_ = std::move(from_->held);
    else
      round_.start = state_;
    Anchor anchor = anchor_of_level(measurements_, scene, round_.start, options_, round_.level,
                                    round_.anchor_sigma_grey);
    PhotometricSystem system(scene, state_, round_.sights, rules(), kernels_, threads_,
                             std::move(anchor));
    if (solve.rounds.empty() || from_) solve.setup_s = clock_.seconds();
    solve.solver = system.solver_name();
    if (!begin_round(system, loss)) return false;
    const Hooks hooks{[] { return Recourse::none; }, [](double) { return false; }, &progress_,
                      [&] { write_down(system); }};
    minimize(system, loss, loop_options(round_.level), clock_, solve,
             round_.level > 0 ? kCoarseMotion : options_.motion_px, &history_, &hooks);
    const std::size_t before = progress_.round_begin;
    LossRound& now = solve.rounds.back();
    now.initial_cost =
        before < solve.iterations.size() ? solve.iterations[before].start_cost : solve.final_cost;
    now.final_cost = solve.final_cost;
    now.steps = static_cast<int>(solve.iterations.size() - before) - (before == 0);
    state_ = system.state();
    return converged();
  }

  /// False where it is to go on from what is of another system.
  bool begin_round(PhotometricSystem& system, const ScaledLoss& loss) {
    Summary& solve = summary_.solve;
    history_.reset();
    if (from_) {
      foreign_ = !system.resume(from_->leaving, from_->home);
      history_ = from_->loop;
      from_.reset();
      return !foreign_;
    }
    LossRound round;
    round.scale_px = loss.kind == LossKind::none ? 0 : loss.scale_px;
    round.sigma_px = sigma_;
    solve.rounds.push_back(round);
    progress_ = {};
    progress_.round_begin = solve.iterations.size();
    return true;
  }

  bool converged() const {
    const Termination end = summary_.solve.termination;
    return end == Termination::cost_converged || end == Termination::gradient_converged ||
           end == Termination::step_converged;
  }

  void report(const PatchStatistics& statistics) {
    summary_.initial_rms_grey = statistics.before().rms;
    summary_.initial_median_grey = statistics.before().median;
    summary_.final_rms_grey = statistics.after().rms;
    summary_.final_median_grey = statistics.after().median;
    summary_.initial_inlier_share = statistics.before().inliers;
    summary_.final_inlier_share = statistics.after().inliers;
    summary_.patches_left = statistics.left();
  }

  static constexpr double kFirstScale = 10;     ///< grey levels: while brightness alone is fitted
  static constexpr double kCoarseMotion = 0.1;  ///< pixels of a coarse level

  const Stopwatch clock_;
  PhotometricProblem& problem_;
  const PhotometricOptions& options_;
  const Pattern pattern_;
  Threads threads_;
  const Kernels& kernels_;
  const RunIdentity identity_;  ///< where the run is written down, or goes on
  const bool rays_;
  const std::vector<Measurement> measurements_;
  PatchState state_;
  bool brightness_fitted_ = false;
  double sigma_ = 0;
  PatchRound round_;
  std::optional<LoopHistory> history_;  ///< of the round
  RunProgress progress_;
  CheckpointTimes times_;
  std::optional<PhotometricCheckpoint> from_;  ///< until its round goes on
  bool foreign_ = false;                       ///< it was of other patches
  PhotometricSummary summary_;
};

}  // namespace

Result<Pattern> check_photometric(const PhotometricProblem& problem,
                                  const PhotometricOptions& options) {
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  if (Result<void> valid = validate(problem); !valid.ok()) return valid.error();
  if (Result<void> fields = check_fields(options); !fields.ok()) return fields.error();
  const bool rays = uses_rays(problem, options);
  if (rays && !problem.has_hosts()) return usage("points on rays (inverse depth) need hosts");
  if (!rays && problem.patches.empty()) return usage("points as xyz need stored patches");
  if (!rays && options.levels > 1)
    return usage("a pyramid needs points on the rays of hosts: stored patches have one size only");
  if (!rays && options.warp == Warp::inverse_depth)
    return usage("the warp by inverse depth needs points on the rays of hosts");
  for (std::size_t i = 0; i < problem.images.size(); ++i)
    if (std::min(problem.images[i].width, problem.images[i].height) >> (options.levels - 1) < 16)
      return usage("image " + std::to_string(i) + " has fewer than 16 x 16 pixels at level " +
                   std::to_string(options.levels));
  if (Result<void> anchor = check_anchor(problem, options); !anchor.ok()) return anchor.error();
  if (!rays) return problem.patch;
  return make_pattern(options.pattern);
}

namespace {

Result<void> check_depths(const PhotometricProblem& problem, const PhotometricOptions& options) {
  if (!uses_rays(problem, options)) return {};
  const PatchState state = state_of(problem, true);
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    if (const double s = state.points[3 * i]; !(s > 0 && std::isfinite(s)))
      return Error(ErrorCode::usage,
                   "point " + std::to_string(i) + " is not in front of its host image");
  return {};
}

}  // namespace

Result<PhotometricSummary> refine_photometric(PhotometricProblem& problem,
                                              const PhotometricOptions& options) {
  const Result<Pattern> pattern = check_photometric(problem, options);
  if (!pattern.ok()) return pattern.error();
  if (Result<void> depths = check_depths(problem, options); !depths.ok()) return depths.error();
  try {
    Refinement refinement(problem, options, pattern.value());
    const std::uint64_t needed = refinement.forecast();
    if (options.memory_limit_bytes > 0 && needed > options.memory_limit_bytes)
      return over_memory_limit(needed, options.memory_limit_bytes);
    return refinement.run();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for these images");
  }
}

}  // namespace sheaf
