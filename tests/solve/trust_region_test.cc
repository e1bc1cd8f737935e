// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/trust_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace sheaf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Rosenbrock's valley as three residuals of two unknowns: r = (10 (y - x^2), 1 - x, `left`). Its
/// minimum lies at (1, 1) with the cost left^2 / 2. The hooks make single answers go wrong. Calls
/// out of the order that the seam promises fail the test.
class Valley : public System {
 public:
  using State = std::array<double, 2>;
  explicit Valley(State start, double left = 0) : held_(start), left_(left) {}

  Step propose(const StepRequest& request) override {
    const double damping = request.damping;
    dampings.push_back(damping);
    radii.push_back(request.radius);
    EXPECT_EQ(request.dogleg, dogleg);
    proposed_from.push_back(held_);
    const auto [x, y] = held_;
    const double r0 = 10 * (y - x * x), r1 = 1 - x;
    // J = [-20 x, 10; -1, 0]
    const double a = (400 * x * x + 1) * (1 + damping), b = -200 * x, c = 100 * (1 + damping);
    gradient_ = {-20 * x * r0 - r1, 10 * r0};
    const double determinant = a * c - b * b;
    step_ = {(-gradient_[0] * c + gradient_[1] * b) / determinant,
             (-gradient_[1] * a + gradient_[0] * b) / determinant};
    damped_ = {a - (400 * x * x + 1), c - 100};
    Step out;
    out.solved = !fails_to_solve;
    out.cost = cost(held_);
    out.gradient_max = std::max({std::abs(gradient_[0]) / std::sqrt(400 * x * x + 1),
                                 std::abs(gradient_[1]) / 10, smallest_gradient});
    ready_ = out.solved ? Ready::to_try : Ready::to_propose;
    return out;
  }

  Trial trial() override {
    EXPECT_EQ(ready_, Ready::to_try);
    ready_ = Ready::to_accept;
    ++trials;
    Trial out;
    const double length = std::hypot(step_[0], step_[1]);
    const double share = std::min(1.0, radii.back() / length);
    double slope = 0, curvature = 0;
    for (int i = 0; i < 2; ++i) {
      slope -= step_[i] * gradient_[i];
      curvature -= step_[i] * (gradient_[i] + damped_[i] * step_[i]);
      step_[i] *= share;
    }
    out.cost = cost({held_[0] + step_[0], held_[1] + step_[1]});
    out.predicted_decrease = share * slope - share * share * curvature / 2;
    out.length = share * length;
    out.damping = dampings.back() / share;
    out.step_norm = std::hypot(step_[0], step_[1]) / std::hypot(held_[0], held_[1]);
    if (on_trial) on_trial(trials, out);
    return out;
  }

  void accept() override {
    EXPECT_EQ(ready_, Ready::to_accept);
    ready_ = Ready::to_propose;
    for (int i = 0; i < 2; ++i) held_[i] += step_[i];
  }

  double residual_scale(double) override { return 0; }

  double cost(const State& s) const {
    const double r0 = 10 * (s[1] - s[0] * s[0]), r1 = 1 - s[0];
    return (r0 * r0 + r1 * r1 + left_ * left_) / 2;
  }
  const State& held() const { return held_; }

  bool fails_to_solve = false;
  double smallest_gradient = 0;
  std::function<void(int trial, Trial& answer)> on_trial;
  bool dogleg = false;  ///< what the loop is expected to ask for
  std::vector<double> dampings, radii;
  std::vector<State> proposed_from;
  int trials = 0;

 private:
  enum class Ready { to_propose, to_try, to_accept };
  State held_;
  double left_;
  State step_{}, gradient_{}, damped_{};
  Ready ready_ = Ready::to_propose;
};

constexpr Valley::State kStart{-1.2, 1};  // the first full step from here climbs
constexpr Valley::State kNear{0.9, 0.8};  // and from here the linear model holds

Summary minimized(Valley& valley, const SolveOptions& options = {}) {
  Summary summary;
  const Stopwatch clock;
  minimize(valley, {}, options, clock, summary);
  EXPECT_FALSE(summary.words.empty());
  EXPECT_FALSE(summary.iterations.empty());
  for (std::size_t i = 0; i < summary.iterations.size(); ++i) {
    const Iteration& it = summary.iterations[i];
    EXPECT_EQ(it.index, static_cast<int>(i));
    if (i == 0) continue;
    const double before = summary.iterations[i - 1].cost;
    EXPECT_EQ(it.cost, it.accepted ? it.trial_cost : before);
    EXPECT_LE(it.cost, before);
    EXPECT_GE(it.time_s, summary.iterations[i - 1].time_s);
  }
  return summary;
}

TEST(TrustRegion, ReachesAMinimumWhoseCostIsZero) {
  Valley valley(kStart);
  const Summary summary = minimized(valley);
  EXPECT_EQ(summary.termination, Termination::gradient_converged);
  EXPECT_DOUBLE_EQ(summary.initial_cost, valley.cost(kStart));
  EXPECT_LT(summary.final_cost, 1e-25);
  EXPECT_NEAR(valley.held()[0], 1, 1e-10);
  EXPECT_NEAR(valley.held()[1], 1, 1e-10);
  EXPECT_TRUE(summary.usable());
}

TEST(TrustRegion, EndsByTheCostAfterTwoSmallDecreases) {
  Valley valley(kStart, 3);
  SolveOptions options;
  options.tolerance = 1e-2;
  options.gradient_tolerance = 0;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::cost_converged);
  EXPECT_NEAR(summary.final_cost, 4.5, 0.1);
  const auto& its = summary.iterations;
  ASSERT_GE(its.size(), 4u);
  std::vector<double> decreases;  // of the steps taken
  for (std::size_t i = 1; i < its.size(); ++i)
    if (its[i].accepted) decreases.push_back((its[i - 1].cost - its[i].cost) / its[i - 1].cost);
  const std::size_t n = decreases.size();
  EXPECT_LT(decreases[n - 1], options.tolerance);
  EXPECT_LT(decreases[n - 2], options.tolerance);
  for (std::size_t i = 0; i + 2 < n; ++i)
    EXPECT_FALSE(decreases[i] < options.tolerance && decreases[i + 1] < options.tolerance);
}

TEST(TrustRegion, EndsByTheGradient) {
  Valley valley(kStart, 3);
  SolveOptions options;
  options.gradient_tolerance = 1e-3;
  options.tolerance = 0;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::gradient_converged);
  // The last gradient was measured at the held state, after the last entry.
  EXPECT_NEAR(summary.final_cost, 4.5, 1e-5);
}

TEST(TrustRegion, EndsByTheStepWhereNothingCanBeGained) {
  Valley valley(kStart, 3);
  valley.smallest_gradient = 1;  // a gradient that does not vanish
  SolveOptions options;
  options.tolerance = 0;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::step_converged);
  EXPECT_TRUE(summary.usable());
  EXPECT_NEAR(summary.final_cost, 4.5, 1e-13);
}

TEST(TrustRegion, AStartAtTheMinimumIsSuccess) {
  Valley valley({1, 1}, 3);
  const Summary summary = minimized(valley);
  EXPECT_EQ(summary.termination, Termination::gradient_converged);
  EXPECT_TRUE(summary.usable());
  EXPECT_EQ(summary.iterations.size(), 1u);
  EXPECT_EQ(summary.final_cost, 4.5);
  EXPECT_EQ(valley.trials, 0);

  Valley perfect({1, 1});  // cost zero: 0 <= tolerance x 0
  EXPECT_EQ(minimized(perfect).termination, Termination::gradient_converged);
}

TEST(TrustRegion, StopsAfterTheIterationsAskedFor) {
  Valley valley(kStart);
  SolveOptions options;
  options.max_iterations = 3;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::max_iterations);
  EXPECT_EQ(summary.iterations.size(), 4u);
  EXPECT_EQ(valley.trials, 3);
  EXPECT_EQ(summary.final_cost, valley.cost(valley.held()));
}

TEST(TrustRegion, NoIterationsOnlyEvaluates) {
  Valley valley(kStart);
  SolveOptions options;
  options.max_iterations = 0;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::max_iterations);
  EXPECT_TRUE(summary.usable());
  EXPECT_EQ(summary.iterations.size(), 1u);
  EXPECT_EQ(summary.final_cost, summary.initial_cost);
  EXPECT_EQ(valley.trials, 0);
  EXPECT_EQ(valley.held(), kStart);
}

TEST(TrustRegion, TheCallbackStops) {
  for (int last : {0, 2}) {
    Valley valley(kStart);
    SolveOptions options;
    std::vector<int> seen;
    options.on_iteration = [&](const Iteration& it) {
      seen.push_back(it.index);
      return it.index < last;
    };
    const Summary summary = minimized(valley, options);
    EXPECT_EQ(summary.termination, Termination::stopped);
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(last) + 1);
    EXPECT_EQ(valley.trials, last);
    EXPECT_EQ(summary.final_cost, valley.cost(valley.held()));
  }
}

TEST(TrustRegion, TheStopTokenStops) {
  Valley valley(kStart);
  StopSource source;
  SolveOptions options;
  options.stop = source.get_token();
  options.on_iteration = [&](const Iteration& it) {
    if (it.index == 1) source.request_stop();
    return true;
  };
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::stopped);
  EXPECT_EQ(valley.trials, 1);
  EXPECT_EQ(summary.final_cost, valley.cost(valley.held()));
}

TEST(TrustRegion, NoTimeStillTellsTheCost) {
  Valley valley(kStart);
  SolveOptions options;
  options.time_limit_s = 0;
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::time_limit);
  EXPECT_EQ(summary.final_cost, valley.cost(kStart));
  EXPECT_EQ(valley.trials, 0);
}

TEST(TrustRegion, NoFiniteTrialAtAllIsNoUsableStep) {
  for (double cost : {kInfinity, kNaN}) {
    Valley valley(kStart);
    valley.on_trial = [&](int, Trial& answer) { answer.cost = cost; };
    const Summary summary = minimized(valley);
    EXPECT_EQ(summary.termination, Termination::no_usable_step);
    EXPECT_FALSE(summary.usable());
    EXPECT_EQ(summary.final_cost, summary.initial_cost);
    EXPECT_EQ(valley.held(), kStart);
  }
}

TEST(TrustRegion, NoSolvableSystemAtAllIsNoUsableStep) {
  Valley valley(kStart);
  valley.fails_to_solve = true;
  const Summary summary = minimized(valley);
  EXPECT_EQ(summary.termination, Termination::no_usable_step);
  EXPECT_EQ(valley.trials, 0);
  EXPECT_TRUE(std::isnan(summary.iterations[1].trial_cost));
}

TEST(TrustRegion, AStartThatIsNotFiniteIsNoUsableStep) {
  for (double x : {kNaN, 1e200}) {
    Valley valley({x, 1});
    const Summary summary = minimized(valley);
    EXPECT_EQ(summary.termination, Termination::no_usable_step);
    EXPECT_EQ(summary.iterations.size(), 1u);
    EXPECT_EQ(valley.trials, 0);
  }
}

TEST(TrustRegion, ARejectedStepOnlyRaisesTheDamping) {
  // A step may be rejected because its cost is not finite, is higher, promises nothing, or falls by
  // a negligible part of what was promised.
  const std::vector<std::function<void(Trial&)>> spoilers = {
      [](Trial& t) { t.cost = kNaN; }, [](Trial& t) { t.cost = -kInfinity; },
      [](Trial& t) { t.cost = 1e9; }, [](Trial& t) { t.predicted_decrease *= -1; },
      [](Trial& t) { t.predicted_decrease = 1e9; }};
  for (const auto& spoil : spoilers) {
    Valley valley(kStart);
    valley.on_trial = [&](int trial, Trial& answer) {
      if (trial <= 3) spoil(answer);
    };
    const Summary summary = minimized(valley);
    EXPECT_EQ(summary.termination, Termination::gradient_converged);
    ASSERT_GE(summary.iterations.size(), 5u);
    double growth = 1;
    for (int i = 0; i < 3; ++i) {
      EXPECT_FALSE(summary.iterations[i + 1].accepted);
      EXPECT_EQ(summary.iterations[i + 1].damping, valley.dampings[i]);
      EXPECT_EQ(valley.proposed_from[i + 1], kStart);
      EXPECT_GT(valley.dampings[i + 1] / valley.dampings[i], growth);  // faster and faster
      growth = valley.dampings[i + 1] / valley.dampings[i];
    }
    EXPECT_LT(summary.final_cost, 1e-20);
  }
}

TEST(TrustRegion, AnUnsolvedProposalIsAskedAgainWithMoreDamping) {
  Valley valley(kStart);
  valley.fails_to_solve = true;
  SolveOptions options;
  options.on_iteration = [&](const Iteration& it) {
    if (it.index == 2) valley.fails_to_solve = false;
    return true;
  };
  const Summary summary = minimized(valley, options);
  EXPECT_EQ(summary.termination, Termination::gradient_converged);
  EXPECT_FALSE(summary.iterations[1].accepted);
  EXPECT_FALSE(summary.iterations[2].accepted);
  EXPECT_GT(valley.dampings[1], valley.dampings[0]);
  EXPECT_GT(valley.dampings[2], valley.dampings[1]);
}

TEST(TrustRegion, GoodStepsLowerTheDamping) {
  Valley valley(kNear);
  SolveOptions options;
  options.initial_damping = 1e-2;
  minimized(valley, options);
  ASSERT_GE(valley.dampings.size(), 3u);
  EXPECT_EQ(valley.dampings[0], 1e-2);
  EXPECT_LT(valley.dampings[1], valley.dampings[0]);
  EXPECT_LT(valley.dampings[2], valley.dampings[1]);
}

TEST(TrustRegion, StepsThatPutPointsBehindAreRejectedWhenAsked) {
  for (Cheirality cheirality : {Cheirality::reject, Cheirality::hold_out, Cheirality::formula}) {
    Valley valley(kNear);
    valley.on_trial = [](int trial, Trial& answer) { answer.newly_behind = trial <= 2 ? 1 : 0; };
    SolveOptions options;
    options.cheirality = cheirality;
    const Summary summary = minimized(valley, options);
    const bool moved = valley.proposed_from[1] != kNear;
    EXPECT_EQ(moved, cheirality == Cheirality::formula);
    if (!moved) {
      EXPECT_EQ(valley.proposed_from[2], kNear);
    }
    EXPECT_LT(summary.final_cost, 1e-20);
  }
}

TEST(TrustRegion, RunsOutOfDampingOnlyAfterAMoveAsConverged) {
  Valley valley(kNear);
  valley.on_trial = [](int trial, Trial& answer) {
    if (trial > 1) answer.cost = kInfinity;
  };
  const Summary summary = minimized(valley);
  EXPECT_TRUE(summary.usable());
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  EXPECT_EQ(summary.final_cost, valley.cost(valley.held()));
}

SolveOptions with_dogleg() {
  SolveOptions options;
  options.trust_region = TrustRegion::dogleg;
  return options;
}

TEST(TrustRegion, ARejectedDoglegAsksForAShorterStepAndNothingElse) {
  Valley valley(kStart);
  valley.dogleg = true;
  std::vector<double> lengths;
  valley.on_trial = [&](int, Trial& answer) { lengths.push_back(answer.length); };
  const Summary summary = minimized(valley, with_dogleg());
  EXPECT_EQ(summary.termination, Termination::gradient_converged);
  EXPECT_LT(summary.final_cost, 1e-25);
  ASSERT_FALSE(summary.iterations[1].accepted);
  EXPECT_EQ(valley.radii[0], kInfinity);
  EXPECT_EQ(valley.radii[1], lengths[0] / 2);
  EXPECT_EQ(valley.dampings[1], valley.dampings[0]);
  for (std::size_t i = 1; i < summary.iterations.size(); ++i) {
    EXPECT_EQ(summary.iterations[i].radius, valley.radii[i - 1]);
    EXPECT_LE(lengths[i - 1], valley.radii[i - 1] * (1 + 1e-12));
  }
  EXPECT_EQ(summary.iterations.back().radius, kInfinity);  // near the end nothing is cut
}

TEST(TrustRegion, ADoglegWithoutASystemAsksForMoreDamping) {
  Valley valley(kNear);
  valley.dogleg = valley.fails_to_solve = true;
  SolveOptions options = with_dogleg();
  options.on_iteration = [&](const Iteration& it) {
    if (it.index == 2) valley.fails_to_solve = false;
    return true;
  };
  EXPECT_EQ(minimized(valley, options).termination, Termination::gradient_converged);
  EXPECT_GT(valley.dampings[1], valley.dampings[0]);
  EXPECT_GT(valley.dampings[2], valley.dampings[1]);
  EXPECT_EQ(valley.radii[2], kInfinity);
}

TEST(TrustRegion, ADoglegGivesUpWhenTheRadiusIsNothing) {
  Valley valley(kNear);
  valley.dogleg = true;
  valley.on_trial = [](int, Trial& answer) { answer.cost = kInfinity; };
  const Summary summary = minimized(valley, with_dogleg());
  EXPECT_EQ(summary.termination, Termination::no_usable_step);
  EXPECT_LT(valley.radii.back(), 1e-20);
  EXPECT_LE(summary.iterations.size(), 20u);
}

TEST(TrustRegion, LevenbergMarquardtKnowsNoRadius) {
  Valley valley(kStart);
  for (const Iteration& it : minimized(valley).iterations) {
    EXPECT_EQ(it.radius, kInfinity);
    EXPECT_FALSE(it.reused);
  }
}

}  // namespace
}  // namespace sheaf
