// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// State and histories written down and read back by another home: the steps of a run that was never
// stopped, bit for bit.
#include <gtest/gtest.h>

#include <optional>

#include "platform/clock.h"
#include "sheaf/sheaf.h"
#include "solve/loss_rounds.h"
#include "solve/trust_region.h"
#include "systems/build.h"

namespace sheaf {
namespace {

/// A run's moment, as a checkpoint would hold it.
struct Moment {
  Problem problem;
  std::optional<LoopHistory> loop;
  HomeHistory home;
};

/// So many steps, from a moment or from the start; `keep`: what there is after the given step.
Summary run(Problem& problem, SolveOptions options, int steps, const Moment* from, int at,
            Moment* keep) {
  Threads threads(2);
  Build build =
      Build::plan(problem, options, {}, *choose_kernels(Simd::best).value(), threads).value();
  const std::unique_ptr<Home> home = build.make_home(problem);
  std::optional<LoopHistory> loop;
  if (from != nullptr) {
    loop = from->loop;
    home->restore(from->home);
  }
  Summary summary;
  if (from != nullptr) summary.iterations.resize(static_cast<std::size_t>(at) + 1);
  options.max_iterations = steps;
  options.initial_damping = 1e-4;
  options.tolerance = 0;
  options.on_iteration = [&](const Iteration& it) {
    if (keep == nullptr || it.index != at) return true;
    keep->problem = problem;
    build.store(*home, keep->problem);
    keep->loop = loop;
    keep->home = home->history();
    return true;
  };
  const Stopwatch clock;
  minimize(*home, {options.loss.kind, options.loss.scale_px}, options, clock, summary,
           std::numeric_limits<double>::infinity(), &loop);
  build.store(*home, problem);
  return summary;
}

void expect_equal_runs(const Problem& start, const SolveOptions& options) {
  constexpr int kSteps = 8, kStop = 3;
  Moment moment;
  Problem whole = start;
  const Summary expected = run(whole, options, kSteps, nullptr, kStop, &moment);
  Problem parts = moment.problem;
  const Summary got = run(parts, options, kSteps, &moment, kStop, nullptr);
  ASSERT_EQ(expected.iterations.size(), got.iterations.size());
  for (std::size_t i = kStop + 1; i < got.iterations.size(); ++i) {
    EXPECT_EQ(expected.iterations[i].cost, got.iterations[i].cost) << i;
    EXPECT_EQ(expected.iterations[i].damping, got.iterations[i].damping) << i;
    EXPECT_EQ(expected.iterations[i].linear_iterations, got.iterations[i].linear_iterations) << i;
  }
  EXPECT_EQ(whole.points, parts.points);
  for (std::size_t i = 0; i < start.num_images(); ++i) {
    EXPECT_EQ(whole.poses[i].rotation, parts.poses[i].rotation);
    EXPECT_EQ(whole.poses[i].translation, parts.poses[i].translation);
  }
}

Problem street() {
  SceneOptions options;
  options.images = 80;
  options.points = 1500;
  return generate(options).value().start;
}

TEST(History, GoesOnAsIfNothingHadHappened) {
  const Problem problem = street();
  for (CameraSolverKind solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit})
    for (LossKind loss : {LossKind::none, LossKind::huber, LossKind::tukey}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(solver) << " " << to_string(loss));
      SolveOptions options;
      options.solver = solver;
      options.loss = {loss, loss == LossKind::tukey ? 4.0 : 1.5};
      expect_equal_runs(problem, options);
    }
}

TEST(History, AnotherSolverGoesOn) {
  const Problem start = street();
  for (const Loss& loss : {Loss(), Loss(Huber{1.5})}) {
    Problem problem = start;
    SolveOptions options;
    options.loss = loss;
    options.initial_damping = 1e-4;
    options.solver = CameraSolverKind::iterative_implicit;
    Threads threads(2);
    Summary summary;
    std::optional<LoopHistory> history;
    int asked = 0;
    const Hooks hooks{[] { return Recourse::none; },
                      [&](double iterations) {
                        EXPECT_GT(iterations, 0);
                        ++asked;
                        return options.solver == CameraSolverKind::iterative_implicit;
                      }};
    const Stopwatch clock;
    for (CameraSolverKind solver :
         {CameraSolverKind::iterative_implicit, CameraSolverKind::sparse}) {
      options.solver = solver;
      Build build =
          Build::plan(problem, options, {}, *choose_kernels(Simd::best).value(), threads).value();
      const std::unique_ptr<Home> home = build.make_home(problem);
      const bool changes = minimize_in_rounds(*home, options, clock, summary, &history, &hooks);
      EXPECT_EQ(changes, solver == CameraSolverKind::iterative_implicit);
      build.store(*home, problem);
    }
    EXPECT_EQ(asked, 1) << "a factor takes no iterations";
    EXPECT_EQ(summary.rounds.size(), 1u);
    double cost = summary.initial_cost;
    for (std::size_t i = 1; i < summary.iterations.size(); ++i) {
      EXPECT_EQ(summary.iterations[i].index, static_cast<int>(i));
      EXPECT_LE(summary.iterations[i].cost, cost * (1 + 1e-12));
      cost = summary.iterations[i].cost;
    }
    Problem plain = start;
    EXPECT_NEAR(summary.final_cost, solve(plain, options).final_cost, 1e-7 * cost);
  }
}

}  // namespace
}  // namespace sheaf
