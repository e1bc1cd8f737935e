// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/loss_rounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "geometry/loss.h"
#include "solve/trust_region.h"

namespace sheaf {
namespace {

/// A provisional scale is estimated anew after each accepted step: while it is wide, outliers pull
/// hard. Once a step gains less than kSettledDecrease of the cost and the scale that is asked for
/// then differs by less than kSettledChange, it is the last; from estimate to estimate it falls to
/// half at most, and differences below kNear are none.
constexpr double kSettledDecrease = 0.01, kSettledChange = 0.02, kNear = 0.01;
/// What was learnt of a loss's curvature serves another scale that is not further away.
constexpr double kAlike = 0.2;
constexpr double kOneStep = std::numeric_limits<double>::infinity();
/// A scale that at the end is further than this from what the residuals there ask for was frozen
/// too early: it moves on, but so often only.
constexpr double kStale = 0.05;
constexpr int kMostReturns = 5;
/// No camera measures better: keeps the scale of perfect data above 0.
constexpr double kLeastSigma_px = 1e-6;
/// The median of |x| for a standard normal x is 1 / 1.4826.
constexpr double kSigmaPerMedian = 1.4826022185056018;
/// Geman-McClure is convex where |r| < c / sqrt(3), Tukey's where |r| < c / sqrt(5), Cauchy's where
/// |r| < c. The last hundredth may be anything.
constexpr double kConvexQuantile = 0.99, kConvexScale = 3;
/// What a scale is multiplied by from step to step, at least.
constexpr double kAnneal = 0.5;

double estimate_sigma(System& system) {
  return std::max(kLeastSigma_px, kSigmaPerMedian * system.residual_scale(0.5));
}

class Rounds {
 public:
  Rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
         Summary& summary, std::optional<LoopHistory>* history, const Hooks* hooks)
      : system_(system),
        options_(options),
        since_start_(since_start),
        summary_(summary),
        history_(history),
        hooks_(hooks) {}
  bool restarts() const { return restarts_; }

  void run() {
    RunProgress* const progress = hooks_ != nullptr ? hooks_->progress : nullptr;
    const bool resumes = progress != nullptr && progress->resumes;
    if (resumes)
      provisional_ = progress->provisional;
    else
      begin();
    for (int returns = resumes ? progress->returns : 0;; ++returns) {
      if (progress != nullptr) progress->returns = returns;
      while (provisional_) {
        descend(kOneStep);
        if (restarts_) return;
        if (!converged()) return finish();
        choose_next();
      }
      descend(options_.tolerance);
      if (restarts_) return;
      if (!converged() || !is_automatic() || returns == kMostReturns) return finish();
      const LossRound there = target();
      if (std::abs(there.scale_px - now().scale_px) <= kStale * now().scale_px) return finish();
      provisional_ = true;
      rescale(there);
    }
  }

 private:
  bool is_automatic() const {
    return options_.loss.kind != LossKind::none && options_.loss.scale_px == kAutomaticScale;
  }
  LossRound& now() { return summary_.rounds.back(); }

  /// The scale wanted at the held state.
  LossRound target() const {
    LossRound round;
    round.scale_px = options_.loss.scale_px;
    if (is_automatic()) {
      round.sigma_px = estimate_sigma(system_);
      round.scale_px = tuning_constant(options_.loss.kind) * round.sigma_px;
    }
    return round;
  }

  void begin() {
    if (*history_) return;  // another solver goes on, with the scale that was the last
    // Without a loss there is one round, whatever the attempts.
    if (options_.loss.kind == LossKind::none && !summary_.rounds.empty()) return;
    summary_.rounds.push_back(target());
    provisional_ = is_automatic();
    if (!options_.loss.graduated) return;
    const double convex = kConvexScale * system_.residual_scale(kConvexQuantile);
    provisional_ = provisional_ || convex > now().scale_px;
    now().scale_px = std::max(convex, now().scale_px);
  }

  /// After a step with a provisional scale: the next one, and whether it is the last.
  void choose_next() {
    LossRound next = target();
    const double wanted = next.scale_px;
    next.scale_px = std::max(wanted, now().scale_px * kAnneal);
    const bool narrows = options_.loss.graduated && next.scale_px > wanted;
    const double change = std::abs(next.scale_px - now().scale_px) / now().scale_px;
    provisional_ = narrows || (is_automatic() &&
                               (last_decrease() >= kSettledDecrease || change >= kSettledChange));
    if (change > (is_automatic() ? kNear : 0)) return rescale(next);
    if (*history_) (*history_)->small_decreases = 0;  // with one step, any decrease was small
  }

  void rescale(const LossRound& next) {
    const double change = std::abs(next.scale_px - now().scale_px) / now().scale_px;
    summary_.rounds.push_back(next);
    if (*history_) (*history_)->rescale(change <= kAlike);
  }

  /// Relative, of the cost by the last step that was taken with the present scale; 0: none was.
  double last_decrease() const {
    const Iteration& last = summary_.iterations.back();
    return last.accepted && last.index > 0 ? (last.start_cost - last.cost) / last.start_cost : 0;
  }

  void finish() {
    if (is_automatic()) summary_.final_sigma_px = estimate_sigma(system_);
  }

  bool converged() const {
    return summary_.termination == Termination::cost_converged ||
           summary_.termination == Termination::gradient_converged ||
           summary_.termination == Termination::step_converged;
  }

  /// Steps with the round's scale until they gain less than the tolerance.
  void descend(double tolerance) {
    std::size_t before = summary_.iterations.size();
    if (hooks_ != nullptr && hooks_->progress != nullptr) {
      RunProgress& progress = *hooks_->progress;
      if (progress.resumes) before = progress.round_begin;
      progress.round_begin = before;
      progress.provisional = provisional_;
    }
    restarts_ =
        minimize(system_, {options_.loss.kind, now().scale_px}, options_, since_start_, summary_,
                 std::numeric_limits<double>::infinity(), history_, hooks_, tolerance);
    const std::size_t after = summary_.iterations.size();
    if (now().steps == 0)
      now().initial_cost =
          after > before ? summary_.iterations[before].start_cost : summary_.final_cost;
    now().final_cost = summary_.final_cost;
    now().steps += static_cast<int>(after - before) - (before == 0 && after > 0);
  }

  System& system_;
  const SolveOptions& options_;
  const Stopwatch& since_start_;
  Summary& summary_;
  bool provisional_ = false;  ///< the scale is still on its way
  std::optional<LoopHistory>* const history_;
  const Hooks* hooks_;
  bool restarts_ = false;
};

}  // namespace

bool minimize_in_rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
                        Summary& summary, std::optional<LoopHistory>* history, const Hooks* hooks) {
  std::optional<LoopHistory> own;
  Rounds rounds(system, options, since_start, summary, history != nullptr ? history : &own, hooks);
  rounds.run();
  return rounds.restarts();
}

}  // namespace sheaf
