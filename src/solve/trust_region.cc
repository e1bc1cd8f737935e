// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/trust_region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <optional>

#include "platform/cancel.h"
#include "solve/step_control.h"

namespace sheaf {
namespace {

/// Measured at 138 to 13682 images, to 1e-3 of the best cost: 0.03 to 0.01 (from the sixth
/// iteration on) take up to twice the inner iterations for no step less, and 20 to 60 % more time.
constexpr double kLoosestForcing = 0.2, kTightestForcing = 0.03;
/// Below this relative decrease of the cost mixed precision goes on in double. Weak directions, of
/// curvature below float's rounding of the strong ones, are what is left then: ladybug-49 needs 86
/// steps to 1e-13 in double and more than 300 in float.
constexpr double kPreciseBelow = 1e-5;
/// A gain below this is a step that did not help.
constexpr double kSmallestGain = 1e-3;
/// Tried on six scenes: 4 and 8 end sooner on some and later on others.
constexpr double kLongest = 2;
/// A step is early among the first kEarly, and the state is far while steps take more than
/// kStillFar of the cost.
constexpr std::size_t kEarly = 15;
constexpr double kStillFar = 0.1;
/// A dogleg begins with steps that are too long, and a shorter one costs it little.
constexpr int kDoglegPatience = 3;
/// px^2. No image is so large.
constexpr double kAbsurdCost = 1e20;
/// Steps whose conjugate gradients say what the next ones will take.
constexpr std::size_t kRecent = 4;
/// A step that changes no block by more than this (relative) is rounding.
constexpr double kRounding = 1e-14;

class Loop {
 public:
  Loop(System& system, const ScaledLoss& loss, const SolveOptions& options, double tolerance,
       const Stopwatch& clock, Summary& summary, double settled_motion_px)
      : system_(system),
        loss_(loss),
        options_(options),
        tolerance_(tolerance),
        since_start_(clock),
        summary_(summary),
        settled_motion_px_(settled_motion_px),
        control_(options.trust_region,
                 options.initial_damping > 0 ? options.initial_damping : default_damping(1),
                 loss.kind != LossKind::none) {}

  bool restarts() const { return restarts_; }
  void may_ask(const Hooks* hooks) {
    hooks_ = hooks;
    if (hooks == nullptr || hooks->progress == nullptr || !hooks->progress->resumes) return;
    RunProgress& from = *hooks->progress;
    from.resumes = false;
    rejected_in_a_row_ = from.rejected_in_a_row;
    any_finite_trial_ = from.any_finite_trial;
    attempt_begin_ = from.attempt_begin;
    for (const int iterations : from.last_iterations) note_iterations(iterations);
  }

  /// Goes on from what is there, and leaves what there is after each step.
  void keep(std::optional<LoopHistory>* history) {
    history_ = history;
    if (history == nullptr || !*history) return;
    const LoopHistory& from = **history;
    control_.restore(from.control);
    forcing_ = from.forcing;
    precise_ = from.precise;
    small_decreases_ = from.small_decreases;
    last_decrease_ = from.last_decrease;
    stretch_ = from.stretch;
    cost_ = from.cost;
    plain_cost_ = from.plain_cost;
    begun_ = from.costs_known;
  }

  void run() {
    try {
      descend();
    } catch (const Cancelled&) {
      if (!begun_) throw;  // nothing is known of the state yet
      out_of_time();
    }
    summary_.final_cost = cost_;
    summary_.final_plain_cost = plain_cost_;
  }

 private:
  void descend() {
    while (!done_) {
      tell_progress();
      loss_.floor = control_.curvature_floor();
      const Step step =
          system_.propose({control_.damping(), forcing_, loss_, last_decrease_, stretch_,
                           &cancelled_, precise_, control_.dogleg(), control_.radius()});
      if (!begun_) begin(step);
      if (done_ || gradient_vanished(step) || out_of_time() || out_of_iterations()) break;
      if (!step.solved && out_of_time()) break;
      if (!step.solved) {
        reject(record(step, std::nullopt), std::nullopt);
        continue;
      }
      const Trial trial = system_.trial();
      Iteration tried = record(step, trial);
      if (accepts(trial, tried))
        accept(trial, tried);
      else
        reject(tried, trial);
    }
  }

  void tell_progress() {
    if (hooks_ == nullptr || hooks_->progress == nullptr) return;
    if (!begun_ && (history_ == nullptr || !*history_)) return;
    RunProgress& to = *hooks_->progress;
    to.rejected_in_a_row = rejected_in_a_row_;
    to.any_finite_trial = any_finite_trial_;
    to.attempt_begin = attempt_begin_;
    to.last_iterations.assign(last_iterations_.begin(), last_iterations_.begin() + noted_);
    if (hooks_->before_step) hooks_->before_step();
  }

  /// The start: nothing tried yet. Later rounds go on from where the one before ended.
  void begin(const Step& step) {
    begun_ = true;
    // A round that goes on keeps its cost: another order of sums would change its last bits.
    const bool recovered = is_recovered();
    const bool goes_on = !recovered && !summary_.rounds.empty() && summary_.rounds.back().steps > 0;
    cost_ = goes_on ? summary_.final_cost : step.cost;
    plain_cost_ = goes_on ? summary_.final_plain_cost : step.plain_cost;
    if (recovered) return tell_recovery(step);
    if (!summary_.iterations.empty()) return;
    summary_.initial_cost = cost_;
    summary_.initial_plain_cost = plain_cost_;
    Iteration start;
    start.cost = start.trial_cost = start.start_cost = cost_;
    start.damping = control_.damping();
    start.radius = control_.radius();
    start.loss_floor = loss_.floor;
    start.scale_px = loss_.kind == LossKind::none ? 0 : loss_.scale_px;
    start.gradient_max = step.gradient_max;
    if (!std::isfinite(cost_)) {
      end(Termination::no_usable_step,
          "the cost of the start is not finite: a point lies in the plane of a camera's centre, or "
          "the numbers overflow");
    }
    publish(start);
  }

  Iteration record(const Step& step, const std::optional<Trial>& trial) const {
    Iteration it;
    it.index = static_cast<int>(summary_.iterations.size());
    it.round = std::max(0, static_cast<int>(summary_.rounds.size()) - 1);
    it.cost = it.start_cost = cost_;
    it.trial_cost = trial ? trial->cost : std::numeric_limits<double>::quiet_NaN();
    it.accepted = false;
    it.damping = control_.damping();
    it.gradient_max = step.gradient_max;
    it.linear_iterations = step.linear_iterations;
    it.radius = control_.radius();
    it.loss_floor = loss_.floor;
    it.scale_px = loss_.kind == LossKind::none ? 0 : loss_.scale_px;
    it.reused = step.reused;
    if (trial) {
      it.gain_ratio = (cost_ - trial->cost) / trial->predicted_decrease;
      it.step_norm = trial->step_norm;
    }
    return it;
  }

  bool accepts(const Trial& trial, const Iteration& it) const {
    if (!std::isfinite(trial.cost) || !(trial.predicted_decrease > 0)) return false;
    if (options_.cheirality != Cheirality::formula && trial.newly_behind > 0) return false;
    return trial.cost < cost_ && it.gain_ratio > kSmallestGain;
  }

  void accept(const Trial& trial, Iteration it) {
    system_.accept();
    const double decrease = last_decrease_ = (cost_ - trial.cost) / cost_;
    cost_ = it.cost = trial.cost;
    plain_cost_ = trial.plain_cost;
    it.accepted = true;
    rejected_in_a_row_ = 0;
    control_.accepted(it.gain_ratio, trial, it.linear_iterations, decrease);
    stretch_ = stretch_ > 1 ? 1 : stretch_after(it.gain_ratio);
    forcing_ = std::clamp(std::sqrt(decrease), kTightestForcing, kLoosestForcing);
    precise_ = precise_ || decrease < kPreciseBelow;
    note_iterations(it.linear_iterations);
    const bool small = decrease < tolerance_ && trial.motion_px <= settled_motion_px_;
    small_decreases_ = small ? small_decreases_ + 1 : 0;
    publish(it);
    if (small_decreases_ >= (std::isinf(tolerance_) ? 1 : 2))
      end(Termination::cost_converged,
          "converged: the cost fell by less than the tolerance, relatively, twice in a row");
    if (!done_ && hooks_ != nullptr && recent_iterations_ > 0 &&
        hooks_->change_solver(recent_iterations_))
      restarts_ = done_ = true;
  }

  /// The mean of the last kRecent steps, once there are so many.
  void note_iterations(int iterations) {
    if (noted_ == kRecent)
      std::copy(last_iterations_.begin() + 1, last_iterations_.end(), last_iterations_.begin());
    else
      ++noted_;
    last_iterations_[noted_ - 1] = iterations;
    int sum = 0;
    for (std::size_t k = 0; k < noted_; ++k) sum += last_iterations_[k];
    recent_iterations_ = noted_ < kRecent ? 0 : static_cast<double>(sum) / kRecent;
  }

  /// Where a loss that forgets is concave the model lies too high however low its floor, and the
  /// gain says by how much: of a mode with the curvature c, in the model C, gain - 1 = 1 - c / C is
  /// left after a step. The next one is lengthened to 1 / (2 - gain) of itself, where that mode
  /// ends, or to kLongest; the one after it is plain, for the modes that this overshoots.
  double stretch_after(double gain) const {
    if (control_.dogleg() || loss_.kind == LossKind::none || is_convex(loss_.kind)) return 1;
    if (control_.curvature_floor() > CurvatureFloor::kLeast || gain < CurvatureFloor::kGenerous)
      return 1;
    return gain < 1.5 ? 1 / (2 - gain) : kLongest;
  }

  void reject(const Iteration& it, const std::optional<Trial>& trial) {
    if (stretch_ > 1) {  // the step itself was not tried
      stretch_ = 1;
      return publish(it);
    }
    const bool finite = std::isfinite(it.trial_cost);
    any_finite_trial_ = any_finite_trial_ || finite;
    // Conjugate gradients that found no positive definite matrix in floats go on in doubles first.
    if (!trial && it.linear_iterations > 0 && !precise_)
      precise_ = true;
    else
      control_.rejected(trial);
    publish(it);
    ++rejected_in_a_row_;
    const Recourse recourse = hooks_ != nullptr && doubtful() ? hooks_->recover() : Recourse::none;
    if (recourse == Recourse::restart) {
      restarts_ = done_ = true;
      return;
    }
    if (recourse == Recourse::end)
      return end(Termination::step_converged, "stopped: no gain could be seen");
    const bool exhausted = control_.exhausted();
    if (exhausted && !any_finite_trial_ && !moved())
      return end(Termination::no_usable_step, "no step led to a finite cost, however short");
    // Below the cost's own rounding a decrease cannot be seen.
    const double predicted = std::abs((cost_ - it.trial_cost) / it.gain_ratio);
    const bool invisible = finite && predicted < 4 * std::numeric_limits<double>::epsilon() * cost_;
    if (invisible || (finite && it.step_norm < kRounding) || (exhausted && finite))
      end(Termination::step_converged,
          "converged: no step changes the cost by more than its rounding");
    else if (exhausted)
      end(Termination::step_converged,
          "stopped: no step from here leads to a finite cost, however short");
  }

  /// A step was rejected that came early, while each took much of the cost: the state is far from
  /// where a linear model is good. From good starts that does not happen.
  bool doubtful() const {
    const int patience = control_.dogleg() ? kDoglegPatience : 1;
    return rejected_in_a_row_ >= patience &&
           summary_.iterations.size() - 1 - attempt_begin_ <= kEarly && last_decrease_ > kStillFar;
  }

  /// Another attempt: where it goes on from stands in the list of steps.
  void tell_recovery(const Step& step) {
    // Where rounding decides, the solver's own cost may be another than the one it was chosen by.
    constexpr double kSame = 1e-9;
    if (!(cost_ <= (1 + kSame) * summary_.final_cost)) {
      cost_ = summary_.final_cost;
      plain_cost_ = summary_.final_plain_cost;
      summary_.recoveries.back().taken = false;
      restarts_ = done_ = true;
      return;
    }
    attempt_begin_ = summary_.iterations.size();
    Iteration it = record(step, std::nullopt);
    it.start_cost = summary_.final_cost;
    it.cost = it.trial_cost = cost_;
    it.accepted = true;
    it.passes = summary_.recoveries.back().passes;
    publish(it);
  }
  bool is_recovered() const {
    return !summary_.recoveries.empty() && summary_.recoveries.back().taken &&
           summary_.recoveries.back().after_step + 1 ==
               static_cast<int>(summary_.iterations.size());
  }

  bool gradient_vanished(const Step& step) {
    // |J_i^T r| / |J_i| is at most |r|: the ratio is the cosine between residual and column.
    if (!(step.gradient_max <= options_.gradient_tolerance * std::sqrt(2 * cost_))) return false;
    // Beside one absurd residual every column looks like none.
    if (hooks_ != nullptr && cost_ > kAbsurdCost && !moved() &&
        hooks_->recover() == Recourse::restart) {
      restarts_ = done_ = true;
      return true;
    }
    end(Termination::gradient_converged, "converged: the scaled gradient is below its tolerance");
    return true;
  }

  bool out_of_iterations() {
    if (steps_of(summary_) < options_.max_iterations) return false;
    std::array<char, 64> words{};
    std::snprintf(words.data(), words.size(), "stopped after %d iterations, as asked",
                  options_.max_iterations);
    end(Termination::max_iterations, words.data());
    return true;
  }

  bool must_stop() const {
    return options_.stop.stop_requested() || since_start_.seconds() >= options_.time_limit_s;
  }

  bool out_of_time() {
    if (options_.stop.stop_requested())
      end(Termination::stopped, "interrupted; the best state so far is kept");
    else if (since_start_.seconds() >= options_.time_limit_s)
      end(Termination::time_limit, "the time limit was reached; the best state so far is kept");
    return done_;
  }

  bool moved() const {
    return std::any_of(summary_.iterations.begin(), summary_.iterations.end(),
                       [](const Iteration& it) { return it.index > 0 && it.accepted; });
  }

  void publish(Iteration it) {
    it.time_s = since_start_.seconds() - summary_.setup_s;
    summary_.iterations.push_back(it);
    if (history_ != nullptr)
      *history_ = {control_.state(), true,           cost_,   plain_cost_, forcing_, precise_,
                   small_decreases_, last_decrease_, stretch_};
    if (options_.on_iteration && !options_.on_iteration(it))
      end(Termination::stopped, "stopped by the caller; the best state so far is kept");
  }

  void end(Termination termination, const char* words) {
    if (done_) return;
    done_ = true;
    summary_.termination = termination;
    summary_.words = words;
  }

  System& system_;
  ScaledLoss loss_;
  const SolveOptions& options_;
  const double tolerance_;
  const Stopwatch& since_start_;
  Summary& summary_;
  const double settled_motion_px_;
  std::optional<LoopHistory>* history_ = nullptr;
  StepControl control_;
  /// An iterative solver solves loosely at first and tighter as the cost settles.
  double forcing_ = kLoosestForcing;
  const std::function<bool()> cancelled_ = [this] { return must_stop(); };
  double cost_ = 0, plain_cost_ = 0;
  /// Float inside the linear solver resolves what is left of the cost no longer.
  bool precise_ = false;
  int small_decreases_ = 0, rejected_in_a_row_ = 0;
  double last_decrease_ = 1, stretch_ = 1;
  bool any_finite_trial_ = false;
  bool begun_ = false, done_ = false;
  const Hooks* hooks_ = nullptr;
  bool restarts_ = false;
  std::array<int, kRecent> last_iterations_{};  ///< the first noted_ of them
  std::size_t noted_ = 0;
  double recent_iterations_ = 0;
  std::size_t attempt_begin_ = 0;  ///< index of the iteration that this attempt started from
};

}  // namespace

double default_damping(std::size_t images) {
  const double scale = std::max(1.0, static_cast<double>(images) / 50);
  return std::min(1e-2, 2e-5 * std::pow(scale, 4));
}

int steps_of(const Summary& summary) {
  int steps = static_cast<int>(summary.iterations.size()) - 1;
  for (const Iteration& it : summary.iterations) steps -= it.passes > 0;
  for (const Recovery& recovery : summary.recoveries) steps += recovery.passes;
  return steps;
}

bool minimize(System& system, const ScaledLoss& loss, const SolveOptions& options,
              const Stopwatch& since_start, Summary& summary, double settled_motion_px,
              std::optional<LoopHistory>* history, const Hooks* hooks,
              std::optional<double> tolerance) {
  Loop loop(system, loss, options, tolerance.value_or(options.tolerance), since_start, summary,
            settled_motion_px);
  loop.keep(history);
  loop.may_ask(hooks);
  loop.run();
  return loop.restarts();
}

}  // namespace sheaf
