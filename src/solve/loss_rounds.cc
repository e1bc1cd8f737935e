// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/loss_rounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/loss.h"
#include "solve/trust_region.h"

namespace sheaf {
namespace {

constexpr int kMostEstimates = 5;
constexpr double kSettled = 0.05;
/// A provisional round ends with its first accepted step: while the scale is wide, outliers pull
/// hard. Going on until two steps gain less than half each pulls a camera of trafalgar-21 (10%
/// outliers of 50 px, Huber) into another minimum, with three times the rotation error.
constexpr double kOneStep = std::numeric_limits<double>::infinity();
/// No camera measures better: keeps the scale of perfect data above 0.
constexpr double kLeastSigma_px = 1e-6;
/// The median of |x| for a standard normal x is 1 / 1.4826.
constexpr double kSigmaPerMedian = 1.4826022185056018;
/// Geman-McClure is convex where |r| < c / sqrt(3), Tukey's where |r| < c / sqrt(5), Cauchy's where
/// |r| < c. The last hundredth may be anything.
constexpr double kConvexQuantile = 0.99, kConvexScale = 3;
/// What a graduated loss multiplies its scale by from round to round.
constexpr double kAnneal = 0.5;

double estimate_sigma(System& system) {
  return std::max(kLeastSigma_px, kSigmaPerMedian * system.residual_scale(0.5));
}

class Rounds {
 public:
  Rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
         Summary& summary)
      : system_(system), options_(options), since_start_(since_start), summary_(summary) {}

  void run() {
    begin();
    for (int estimates = 1; is_provisional(); estimates += !anneals_) {
      descend(kOneStep);
      if (!converged()) break;
      const LossRound next = next_round();
      if (is_automatic() && (is_near(next.scale_px) || estimates == kMostEstimates)) break;
      summary_.rounds.push_back(next);
    }
    if (!is_provisional() || converged()) descend(options_.tolerance);
    if (is_automatic()) summary_.final_sigma_px = estimate_sigma(system_);
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
    summary_.rounds.push_back(target());
    if (!options_.loss.graduated) return;
    const double convex = kConvexScale * system_.residual_scale(kConvexQuantile);
    anneals_ = convex > now().scale_px;
    now().scale_px = std::max(convex, now().scale_px);
  }

  LossRound next_round() {
    LossRound next = target();
    anneals_ = options_.loss.graduated && next.scale_px < now().scale_px * kAnneal;
    if (anneals_) next.scale_px = now().scale_px * kAnneal;
    return next;
  }

  /// Whether another scale may follow this one.
  bool is_provisional() const { return anneals_ || is_automatic(); }

  bool is_near(double scale_px) {
    return std::abs(scale_px - now().scale_px) <= kSettled * now().scale_px;
  }

  bool converged() const {
    return summary_.termination == Termination::cost_converged ||
           summary_.termination == Termination::gradient_converged ||
           summary_.termination == Termination::step_converged;
  }

  /// Steps with the round's scale until they gain less than the tolerance.
  void descend(double tolerance) {
    SolveOptions options = options_;
    options.tolerance = tolerance;
    const std::size_t before = summary_.iterations.size();
    if (before > 1) options.initial_damping = summary_.iterations.back().damping;
    minimize(system_, {options_.loss.kind, now().scale_px}, options, since_start_, summary_);
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
  bool anneals_ = false;  ///< the round's scale is wider than wanted: a graduated loss on its way
};

}  // namespace

void minimize_in_rounds(System& system, const SolveOptions& options, const Stopwatch& since_start,
                        Summary& summary) {
  Rounds(system, options, since_start, summary).run();
}

}  // namespace sheaf
