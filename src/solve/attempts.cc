// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/attempts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "platform/cancel.h"
#include "scene/behind.h"
#include "scene/rigs.h"
#include "solve/endings.h"
#include "solve/loss_rounds.h"
#include "solve/recovery.h"
#include "solve/trust_region.h"

namespace sheaf {
namespace {

double rms(double cost, std::size_t observations) {
  return observations > 0 ? std::sqrt(2 * cost / static_cast<double>(observations)) : 0;
}

const char* to_string(PointParametrisation points) {
  switch (points) {
    case PointParametrisation::homogeneous:
      return "homogeneous";
    case PointParametrisation::inverse_depth:
      return "inverse-depth";
    case PointParametrisation::automatic:
    case PointParametrisation::xyz:
      break;
  }
  return "xyz";
}

void tell(const Build& build, const SolveOptions& options, const Kernels& kernels,
          const Threads& threads, Summary& summary) {
  const Choice& choice = build.choice();
  summary.points = to_string(build.points().points);
  summary.points_reason = build.points().reason;
  summary.solver = to_string(choice.plan.kind);
  summary.solver_reason = choice.plan.reason;
  summary.precision = choice.plan.mixed ? "mixed" : "double";
  summary.forecast_bytes = choice.forecast_bytes;
  summary.simd = kernels.name;
  summary.loss = options.loss.kind;
  summary.threads = threads.count();
  if (options.on_plan) options.on_plan(summary);
}

/// As it is asked for by name.
CameraSolverKind solver_named(SolverKind kind) {
  switch (kind) {
    case SolverKind::blocks:
      break;
    case SolverKind::dense:
      return CameraSolverKind::dense;
    case SolverKind::sparse:
      return CameraSolverKind::sparse;
    case SolverKind::explicit_cg:
      return CameraSolverKind::iterative_explicit;
    case SolverKind::implicit_cg:
      return CameraSolverKind::iterative_implicit;
  }
  return CameraSolverKind::automatic;
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

/// A solve of one problem: its attempts, each with a home of its own.
class Attempts {
 public:
  Attempts(Problem& problem, SolveOptions& options, const SolveMeans& means, Summary& summary)
      : problem_(problem),
        options_(options),
        kernels_(means.kernels),
        clock_(means.clock),
        summary_(summary),
        threads_(means.threads),
        kept_(means.kept),
        pixel_rms_(means.pixel_rms),
        skip_(held_out(problem, options, threads_, summary)),
        used_(problem.num_observations() - summary.rejected_observations.size()),
        identity_(means.identity) {
    if (options_.initial_damping == 0)
      options_.initial_damping = default_damping(problem.num_images());
  }

  /// Goes on from where another process was.
  void resume(Checkpoint from) {
    const std::vector<std::uint64_t> left_out = std::move(summary_.rejected_observations);
    const TermCosts terms = summary_.initial_terms;
    summary_ = std::move(from.summary);
    summary_.rejected_observations = left_out;
    summary_.initial_terms = terms;
    summary_.simd = kernels_.name;
    summary_.threads = threads_.count();
    summary_.resumed_after = summary_.iterations.back().index;
    options_.recoveries = from.recoveries;
    options_.solver = from.solver;
    options_.initial_damping = from.initial_damping;
    history_ = from.loop;
    progress_ = from.progress;
    progress_.resumes = true;
    put(from.attempt_start, problem_);
    held_ = std::move(from.cameras);
    points_ = std::move(from.points);
    home_ = std::move(from.home);
    if (options_.on_plan) options_.on_plan(summary_);
  }

  Result<void> run() {
    for (bool first = !held_.has_value();; first = false) {
      const Result<void> done = attempt(first);
      if (done.ok() && !better_) tell_ending();
      if (!done.ok() || !better_) return done;
      put(*better_, problem_);
      better_.reset();
    }
  }

 private:
  /// `refine`, or the end of it in the middle of a pass before anything is known of the system.
  Result<void> attempt(bool first) {
    const std::function<bool()> asked = [this] { return out_of_time(); };
    try {
      const CancelScope scope(asked);
      return refine(first);
    } catch (const Cancelled&) {
      if (!summary_.iterations.empty()) put(reached_, problem_);
      tell_cut_short();
      return {};
    }
  }

  /// The start is kept, or what an attempt before had reached.
  void tell_cut_short() {
    const bool stopped = options_.stop.stop_requested();
    const std::string why = stopped ? "interrupted" : "the time limit was reached";
    summary_.termination = stopped ? Termination::stopped : Termination::time_limit;
    summary_.solve_s = clock_.seconds() - summary_.setup_s;
    if (!summary_.iterations.empty()) {
      summary_.words = why + "; the best state so far is kept";
      return;
    }
    summary_.words = why + " before the first step; the start is kept";
    summary_.rejected_observations.clear();
    // Of what is known without a system: without a loss.
    Iteration start;
    start.cost = start.start_cost = start.trial_cost = evaluate(problem_).cost;
    start.time_s = summary_.solve_s;
    for (double* cost : {&summary_.initial_cost, &summary_.final_cost, &summary_.initial_plain_cost,
                         &summary_.final_plain_cost})
      *cost = start.cost;
    summary_.iterations.push_back(start);
    if (summary_.rounds.empty()) summary_.rounds.push_back({});
  }

  /// Builds a system of the problem and refines it; stores it unless there is a better state to go
  /// on from. What went wrong, if anything. A home that is kept is one of a first attempt that was
  /// the last one too.
  Result<void> refine(bool first) {
    KeptHome own;
    const bool keeps = first && kept_ != nullptr && may_keep();
    KeptHome& at = keeps ? *kept_ : own;
    const bool again = keeps && begin_again(at);
    std::optional<Structure> structure = std::move(at.structure);
    at.structure.reset();  // whatever interrupts this leaves nothing to begin again with
    if (kept_ != nullptr && first) kept_->used = again;
    if (!again) {
      at.forget();
      const Result<void> made = set_up(first, at);
      if (!made.ok()) return made.error();
      if (keeps && at.build->can_stay()) {
        at.build->stay(problem_);
        structure.emplace(problem_);
      }
    }
    if (first) tell_start(*at.build, *at.home, again);
    const bool restarts = descend(*at.build, *at.home);
    const bool behind_after = !restarts && at.home->count_behind() > 0;
    if (!restarts && has_sigmas()) pixel_rms_.after = at.home->pixel_rms();
    if (restarts || !keeps) {
      at.home.reset();
      at.lent.reset();
    }
    if (restarts) {
      if (seeks_) seek_better();
      if (!better_) better_ = reached_;  // there was none
      return {};
    }
    if (keeps) at.structure = std::move(structure);
    summary_.solve_s = clock_.seconds() - summary_.setup_s;
    if (behind_after) summary_.behind_camera_after = behind_camera(problem_, threads_);
    return {};
  }

  /// Whether a home of this run may begin again: what such runs do is a function of the problem's
  /// state in no other way than their homes say.
  bool may_keep() const {
    return skip_.empty() && options_.checkpoint.empty() && options_.resume.empty() &&
           options_.memory_limit_bytes == 0 && !options_.lend_observations;
  }

  bool begin_again(KeptHome& at) const {
    return at.structure && at.structure->is_of(problem_) && at.build->restart(problem_, *at.home);
  }

  /// A plan and its home. Observations are lent when the plan is told and before the home is made.
  Result<void> set_up(bool first, KeptHome& at) {
    Result<Build> planned = Build::plan(problem_, options_, skip_, kernels_, threads_);
    if (!planned.ok()) return planned.error();
    at.build.emplace(std::move(planned).value());
    if (first) tell(*at.build, options_, kernels_, threads_, summary_);
    if (first && at.build->lends())
      summary_.behind_camera_before = behind_camera(problem_, threads_);
    if (at.build->lends()) at.build->lend(problem_, at.lent);
    const bool resumes = held_.has_value();
    Result<std::unique_ptr<Home>> made = make_home(*at.build);
    if (!made.ok()) return made.error();
    at.home = std::move(made).value();
    if (resumes) summary_.setup_s = clock_.seconds();
    return {};
  }

  void tell_start(const Build& build, Home& home, bool again) {
    if (again) tell(build, options_, kernels_, threads_, summary_);
    if (!build.lends() && home.count_behind() > 0)
      summary_.behind_camera_before = behind_camera(problem_, threads_);
    if (has_sigmas()) pixel_rms_.before = home.pixel_rms();
    // Observations are at hand where a home does not know.
    if (!problem_.observation_sigma.empty() && !(pixel_rms_.before >= 0))
      pixel_rms_.before = evaluate(problem_).rms_px;
    summary_.setup_s = clock_.seconds();
  }

  /// Whether there is to be another attempt; else what was reached is stored.
  bool descend(Build& build, Home& home) {
    build_ = &build;
    home_at_work_ = &home;
    const bool written = !options_.checkpoint.empty() || !options_.resume.empty();
    const Hooks hooks{
        [this] { return find_better(*build_, *home_at_work_); },
        [this](double iterations) { return change_solver(*build_, *home_at_work_, iterations); },
        written ? &progress_ : nullptr, [this] { write_down(*home_at_work_); }};
    const bool restarts = minimize(home, hooks);
    const std::function<bool()> never = [] { return false; };
    const CancelScope to_the_end(never);  // what is reached is stored, whoever asks to stop
    if (!restarts) build.store(home, problem_);
    return restarts;
  }

  /// Steps in rounds. Between two of them a pass may be given up, too: the home's state is then the
  /// best one, with what the last step left of it.
  bool minimize(Home& home, const Hooks& hooks) {
    try {
      return minimize_in_rounds(home, options_, clock_, summary_, &history_, &hooks);
    } catch (const Cancelled&) {
      if (!history_) throw;  // no step has been made of this attempt
      if (summary_.rounds.size() > 1 && summary_.rounds.back().steps == 0)
        summary_.rounds.pop_back();
      tell_cut_short();
      return false;
    }
  }

  /// Of the problem's state, or of a checkpoint's, which was reached from it.
  Result<std::unique_ptr<Home>> make_home(Build& build) {
    if (!held_) return build.make_home(problem_);
    std::unique_ptr<Home> home;
    if (build.fits(*held_, problem_)) {
      problem_.points.swap(points_);
      home = build.make_home(problem_, &*held_);
      problem_.points.swap(points_);
    }
    held_.reset();
    if (home == nullptr || !home->restore(home_)) return senseless_checkpoint(options_.resume);
    return home;
  }

  /// A checkpoint, where it is time for one. A run that is to stop leaves where it stands.
  void write_down(const Home& home) {
    if (!history_ || !times_.is_due(options_, clock_)) return;
    Checkpoint out;
    out.identity = identity_;
    out.summary = summary_;
    out.loop = *history_;
    out.progress = progress_;
    out.home = home.history();
    out.attempt_start = estimate_of(problem_);
    out.cameras = home.cameras();
    out.points = problem_.points;
    home.store_points(out.points);
    out.recoveries = options_.recoveries;
    out.solver = options_.solver;
    out.initial_damping = options_.initial_damping;
    times_.note(write_checkpoint(out, options_.checkpoint), clock_, summary_);
  }

  void tell_ending() {
    const auto ending = ending_of(problem_, skip_, options_, summary_, threads_);
    if (!ending) return;
    summary_.termination = ending->termination;
    summary_.words = ending->words;
  }

  bool has_sigmas() const { return !problem_.observation_sigma.empty() && skip_.empty(); }

  bool out_of_time() const {
    return options_.stop.stop_requested() || clock_.seconds() >= options_.time_limit_s;
  }

  /// Whether there is a better state than the home's, or none that could be seen to be.
  Recourse find_better(const Build& build, const Home& home) {
    // A state that fits to a twentieth of a pixel is not far from anything.
    const bool near = rms(summary_.iterations.back().cost, used_) < 0.05;
    // Starts move images one by one and know nothing but pixels.
    const bool more = has_rigid_frames(problem_.rigs) || !problem_.terms.empty() ||
                      !problem_.observation_sigma.empty();
    if (options_.recoveries == 0 || near || more || steps_of(summary_) >= options_.max_iterations)
      return Recourse::none;
    --options_.recoveries;
    start_ = estimate_of(problem_);
    build.store(home, problem_);
    reached_ = estimate_of(problem_);
    put(start_, problem_);
    // Observations that are lent are at hand again once the home is gone.
    seeks_ = build.lends();
    return seeks_ ? Recourse::restart : seek_better();
  }

  /// Sets `better_` where recover() finds it; the problem's observations must be at hand.
  Recourse seek_better() {
    seeks_ = false;
    const RecoveryRequest request{problem_,
                                  skip_,
                                  options_.fixed,
                                  {options_.loss.kind, summary_.rounds.back().scale_px},
                                  options_.max_iterations - steps_of(summary_),
                                  [this] { return out_of_time(); }};
    Recovered found = recover(request, start_, reached_, threads_);
    if (found.found && options_.cheirality != Cheirality::formula &&
        puts_behind(start_, reached_, found.state))
      found.found = found.record.taken = false;
    found.record.after_step = summary_.iterations.back().index;
    summary_.recoveries.push_back(found.record);
    if (found.found) {
      better_ = std::move(found.state);
      history_.reset();
      return Recourse::restart;
    }
    options_.recoveries = 0;
    put(reached_, problem_);
    const bool drowned = drowning_observation(problem_, skip_, request.loss, threads_).has_value();
    put(start_, problem_);
    return drowned ? Recourse::end : Recourse::none;
  }

  /// Whether the camera solver that is cheaper by what conjugate gradients really take goes on.
  bool change_solver(const Build& build, const Home& home, double iterations) {
    const Choice& choice = build.choice();
    if (choice.counts == nullptr) return false;
    // Products in double cost about twice those that the counts assume.
    const double counted = iterations * (choice.plan.mixed ? 1 : 2);
    const std::optional<Plan> plan = better_plan(*choice.counts, choice.plan.kind, counted);
    if (!plan) return false;
    const std::string to = to_string(plan->kind);
    summary_.solver_changes.push_back(
        {summary_.iterations.back().index, iterations, summary_.solver, to});
    summary_.solver = to;
    summary_.solver_reason = "after conjugate gradients of " +
                             std::to_string(static_cast<int>(iterations + 0.5)) +
                             " iterations a step: " + plan->reason;
    if (options_.on_plan) options_.on_plan(summary_);
    options_.solver = solver_named(plan->kind);
    const Estimate start = estimate_of(problem_);
    build.store(home, problem_);
    better_ = reached_ = estimate_of(problem_);
    put(start, problem_);
    return true;
  }

  /// Whether an observation is behind its camera that was not so in the state that was reached.
  bool puts_behind(const Estimate& start, const Estimate& reached, const Estimate& found) {
    const auto behind = [&](const Estimate& state) {
      put(state, problem_);
      std::vector<std::uint64_t> all = behind_camera(problem_, threads_);
      std::erase_if(all, [&](std::uint64_t i) { return !skip_.empty() && skip_[i]; });
      return all;
    };
    const auto before = behind(reached), after = behind(found);
    put(start, problem_);
    return !std::includes(before.begin(), before.end(), after.begin(), after.end());
  }

  Problem& problem_;
  SolveOptions& options_;  ///< with what the run changes
  const Kernels& kernels_;
  const Stopwatch& clock_;
  Summary& summary_;
  Threads& threads_;
  KeptHome* const kept_;
  PixelRms& pixel_rms_;
  const std::vector<std::uint8_t> skip_;
  const std::size_t used_;          ///< observations
  std::optional<Estimate> better_;  ///< to go on from
  Estimate start_, reached_;        ///< of the attempt, when a better one was sought
  bool seeks_ = false;              ///< a better one is to be sought once the home is gone
  std::optional<LoopHistory> history_;
  const RunIdentity& identity_;  ///< of the run, where it is written down
  RunProgress progress_;
  CheckpointTimes times_;
  Build* build_ = nullptr;  ///< of the attempt
  Home* home_at_work_ = nullptr;
  // Of a checkpoint, until its home is made.
  std::optional<CameraState> held_;
  std::vector<double> points_;
  HomeHistory home_;
};

}  // namespace

Result<void> solve_in_attempts(Problem& problem, SolveOptions& options, const SolveMeans& means,
                               std::optional<Checkpoint> from, Summary& summary) {
  Attempts attempts(problem, options, means, summary);
  if (from) attempts.resume(std::move(*from));
  return attempts.run();
}

}  // namespace sheaf
