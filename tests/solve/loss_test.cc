// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/loss.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "report/errors.h"
#include "sheaf/sheaf.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

constexpr LossKind kLosses[] = {LossKind::huber, LossKind::soft_l1, LossKind::cauchy,
                                LossKind::tukey, LossKind::geman_mcclure};

/// The small scene's start with a tenth of its pixels off by 30.
Problem with_outliers() {
  const Scene scene = small_scene();
  Problem problem = with_pixels(scene.truth, {.outliers = 0.1, .outlier_px = 30});
  problem.poses = scene.start.poses;
  problem.cameras = scene.start.cameras;
  problem.points = scene.start.points;
  return problem;
}

void expect_rounds_fall(const Summary& s) {
  ASSERT_FALSE(s.rounds.empty());
  std::size_t at = 0;
  for (std::size_t k = 0; k < s.rounds.size(); ++k) {
    const LossRound& round = s.rounds[k];
    if (k == 0) {
      EXPECT_EQ(s.iterations[at++].cost, round.initial_cost);
    }
    double cost = round.initial_cost;
    for (int step = 0; step < round.steps; ++step, ++at) {
      ASSERT_LT(at, s.iterations.size());
      const Iteration& it = s.iterations[at];
      EXPECT_EQ(it.round, static_cast<int>(k));
      EXPECT_EQ(it.start_cost, cost);
      EXPECT_LE(it.cost, cost);
      cost = it.cost;
    }
    EXPECT_EQ(cost, round.final_cost);
  }
  EXPECT_EQ(at, s.iterations.size());
  EXPECT_EQ(s.rounds.front().initial_cost, s.initial_cost);
  EXPECT_EQ(s.rounds.back().final_cost, s.final_cost);
}

TEST(SolveWithLoss, EndsWhereTheRobustCostIsStationary) {
  for (LossKind kind : kLosses) {
    SCOPED_TRACE(to_string(kind));
    Problem problem = small_scene().start;
    const ScaledLoss loss{kind, kind == LossKind::tukey ? 4.0 : 1.5};
    const double before = robust_cost(problem, loss), plain = evaluate(problem).cost;
    const double gradient = scaled_gradient(problem, {}, 20, loss);
    SolveOptions options;
    options.loss = {kind, loss.scale_px, false};
    options.tolerance = 1e-13;
    options.max_iterations = 200;
    if (!is_convex(kind)) {  // far from the minimum these forget too much
      options.loss.graduated = true;
    }
    const Summary s = solve(problem, options);
    EXPECT_EQ(s.loss, kind);
    EXPECT_EQ(s.rounds.back().scale_px, loss.scale_px);
    EXPECT_EQ(s.rounds.back().sigma_px, 0);
    EXPECT_LE(scaled_gradient(problem, {}, 20, loss), 1e-4 * gradient);
    const double after = robust_cost(problem, loss);
    EXPECT_LT(after, before);
    EXPECT_NEAR(s.final_cost, after, 1e-10 * after);
    EXPECT_NEAR(s.initial_plain_cost, plain, 1e-10 * plain);
    EXPECT_NEAR(s.final_plain_cost, evaluate(problem).cost, 1e-10 * plain);
    EXPECT_NEAR(s.final_rms_px, evaluate(problem).rms_px, 1e-9);
    expect_rounds_fall(s);
  }
}

TEST(SolveWithLoss, TakesTheLossByName) {
  Problem problem = small_scene().start;
  const Summary s = solve(problem, {.loss = Huber{1.0}});
  EXPECT_EQ(s.loss, LossKind::huber);
  ASSERT_EQ(s.rounds.size(), 1u);
  EXPECT_EQ(s.rounds[0].scale_px, 1);
  EXPECT_EQ(s.final_sigma_px, 0);
  EXPECT_NEAR(s.final_cost, robust_cost(problem, {LossKind::huber, 1}), 1e-10 * s.final_cost);
}

TEST(SolveWithLoss, AWideOneIsNone) {
  Problem plain = small_scene().start, wide = plain;
  const Summary expected = solve(plain);
  const Summary s = solve(wide, {.loss = Cauchy{1e7}});
  EXPECT_NEAR(s.final_cost, expected.final_cost, 1e-9 * expected.final_cost);
  EXPECT_EQ(expected.rounds.size(), 1u);
  EXPECT_EQ(expected.rounds[0].scale_px, 0);
  expect_rounds_fall(expected);
  EXPECT_EQ(expected.initial_plain_cost, expected.initial_cost);
  EXPECT_EQ(expected.final_plain_cost, expected.final_cost);
}

TEST(SolveWithLoss, ForgetsOutliers) {
  const Scene scene = small_scene();
  const auto center_error = [&](const Loss& loss) {
    Problem problem = with_outliers();
    const Summary s = solve(problem, {.loss = loss});
    EXPECT_TRUE(s.usable());
    return compare_states(problem, scene.truth, true).value().center_error.rms;
  };
  const double plain = center_error({});
  for (LossKind kind : kLosses) EXPECT_LT(center_error({kind}), 0.2 * plain) << to_string(kind);
}

TEST(SolveWithLoss, AutomaticScaleSettles) {
  for (LossKind kind : kLosses) {
    SCOPED_TRACE(to_string(kind));
    Problem problem = with_outliers();
    SolveOptions options;
    options.loss.kind = kind;
    options.max_iterations = 100;
    const Summary s = solve(problem, options);
    expect_rounds_fall(s);
    EXPECT_GE(s.rounds.size(), 2u);
    EXPECT_LE(s.rounds.size(), 10u);
    for (std::size_t k = 0; k < s.rounds.size(); ++k) {
      const double wanted = tuning_constant(kind) * s.rounds[k].sigma_px;
      const double least = k == 0 ? 0 : s.rounds[k - 1].scale_px / 2;
      EXPECT_DOUBLE_EQ(s.rounds[k].scale_px, std::max(wanted, least)) << k;
    }
    for (const Iteration& it : s.iterations)
      EXPECT_EQ(it.scale_px, s.rounds[std::size_t(it.round)].scale_px);
    EXPECT_DOUBLE_EQ(s.rounds.back().scale_px, tuning_constant(kind) * s.rounds.back().sigma_px);
    // Noise of 0.5 px, less what the fit takes up, and a little more for the outliers.
    EXPECT_NEAR(s.final_sigma_px, s.rounds.back().sigma_px, 0.05 * s.final_sigma_px);
    EXPECT_GT(s.final_sigma_px, 0.35);
    EXPECT_LT(s.final_sigma_px, 0.7);
    EXPECT_GT(s.rounds.front().sigma_px, 2 * s.final_sigma_px) << "the start is far off";
  }
}

/// The weight alone took some hundred steps for any of these (docs/math.md, section 12).
TEST(SolveWithLoss, EndsInFewStepsWhereTheGradientIsZero) {
  for (LossKind kind : {LossKind::huber, LossKind::soft_l1, LossKind::cauchy}) {
    SCOPED_TRACE(to_string(kind));
    Problem problem = with_outliers();
    SolveOptions options;
    options.loss = {kind, 0.7};
    options.tolerance = options.gradient_tolerance = 0;
    const Summary s = solve(problem, options);
    EXPECT_EQ(s.termination, Termination::step_converged) << s.words;
    EXPECT_LE(s.iterations.size(), 31u);
    EXPECT_LT(s.iterations.back().gradient_max, 1e-6 * s.iterations.front().gradient_max);
    const auto least = std::min_element(
        s.iterations.begin(), s.iterations.end(),
        [](const Iteration& a, const Iteration& b) { return a.loss_floor < b.loss_floor; });
    EXPECT_LT(least->loss_floor, 0.1) << "and the floor had its part in it";
    for (const Iteration& it : s.iterations) EXPECT_GE(it.loss_floor, 1e-3);
  }
}

TEST(SolveWithLoss, GraduatedTightensByHalvesToTheScale) {
  Problem problem = with_outliers();
  SolveOptions options;
  options.loss = GemanMcClure{2.0, true};
  const Summary s = solve(problem, options);
  expect_rounds_fall(s);
  ASSERT_GE(s.rounds.size(), 4u);
  for (std::size_t k = 1; k < s.rounds.size(); ++k) {
    EXPECT_LT(s.rounds[k].scale_px, s.rounds[k - 1].scale_px);
    EXPECT_GE(s.rounds[k].scale_px, 0.5 * s.rounds[k - 1].scale_px);
  }
  EXPECT_EQ(s.rounds.back().scale_px, 2);
}

TEST(SolveWithLoss, BearsPerfectData) {
  for (LossKind kind : kLosses) {
    Problem problem = small_scene().truth;
    SolveOptions options;
    options.loss.kind = kind;
    const Summary s = solve(problem, options);
    EXPECT_TRUE(s.usable()) << s.words;
    EXPECT_GT(s.rounds.back().scale_px, 0);
    EXPECT_LT(s.final_rms_px, 1e-6);
  }
}

TEST(SolveWithLoss, StopsWhereAskedInAnyRound) {
  for (int steps : {0, 1, 3, 7}) {
    Problem problem = with_outliers();
    SolveOptions options;
    options.loss = Cauchy();
    options.max_iterations = steps;
    const Summary s = solve(problem, options);
    EXPECT_EQ(s.iterations.size(), static_cast<std::size_t>(steps) + 1);
    EXPECT_EQ(s.termination, Termination::max_iterations);
    expect_rounds_fall(s);
  }
}

TEST(SolveWithLoss, RefusesWhatMakesNoSense) {
  Problem problem = small_scene().start;
  const auto refused = [&](const Loss& loss) {
    const Result<Summary> result = try_solve(problem, {.loss = loss});
    return !result.ok() && result.error().code() == ErrorCode::usage;
  };
  EXPECT_TRUE(refused(Huber{-1}));
  EXPECT_TRUE(refused(Huber{std::nan("")}));
  EXPECT_TRUE(refused(Huber{INFINITY}));
  EXPECT_TRUE(refused({LossKind::huber, 1, true}));
}

TEST(SolveWithLoss, ReachesWhatCeresReaches) {
  const std::string path = real_data("dubrovnik-16-22106-pre.txt");
  if (path.empty()) GTEST_SKIP() << "dubrovnik-16 is not in $SHEAF_DATA/bal";
  Problem start = read(path).value();
  solve(start, {.max_iterations = 100, .tolerance = 1e-12});
  // Ceres' final costs from the same start (bench/peers, dense_schur-analytic-inner-cauchy=3, ...).
  const std::pair<Loss, double> known[] = {
      {Cauchy{3}, 12585.9847176}, {SoftL1{3}, 14403.0243496}, {Tukey{20}, 15615.9594572}};
  for (const auto& [loss, cost] : known) {
    Problem problem = start;
    const Summary s = solve(problem, {.max_iterations = 300, .tolerance = 1e-13, .loss = loss});
    EXPECT_NEAR(s.final_cost, cost, 1e-8 * cost) << to_string(loss.kind);
  }
}

/// Root mean square over seeds of the mean rotation and centre errors.
struct PoseErrors {
  double rotation = 0, center = 0;
};

PoseErrors errors_with(const Problem& truth, const Loss& loss, double outliers) {
  constexpr int kSeeds = 5;
  PoseErrors sum;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    Problem problem = with_pixels(truth, {.outliers = outliers, .seed = seed});
    disturb(problem, {.seed = seed});
    solve(problem, {.loss = loss});
    const StateErrors errors = compare_states(problem, truth, true).value();
    sum.rotation += std::pow(errors.rotation_error_rad.mean, 2) / kSeeds;
    sum.center += std::pow(errors.center_error.mean, 2) / kSeeds;
  }
  return {std::sqrt(sum.rotation), std::sqrt(sum.center)};
}

class RealOutliers : public testing::TestWithParam<const char*> {};

TEST_P(RealOutliers, HuberAndCauchyKeepThePosesAndThePlainLossDoesNot) {
  const std::string path = real_data(GetParam());
  if (path.empty()) GTEST_SKIP() << GetParam() << " is not in $SHEAF_DATA/bal";
  Problem truth = read(path).value();
  solve(truth, {.max_iterations = 100, .tolerance = 1e-10});
  for (const Loss& loss : {Loss(Huber()), Loss(Cauchy())}) {
    const PoseErrors clean = errors_with(truth, loss, 0), dirty = errors_with(truth, loss, 0.1);
    EXPECT_LT(dirty.rotation, 2 * clean.rotation) << to_string(loss.kind);
    EXPECT_LT(dirty.center, 2.2 * clean.center) << to_string(loss.kind);
  }
  const PoseErrors clean = errors_with(truth, {}, 0), dirty = errors_with(truth, {}, 0.1);
  EXPECT_GT(dirty.rotation, 5 * clean.rotation);
  EXPECT_GT(dirty.center, 5 * clean.center);
}

INSTANTIATE_TEST_SUITE_P(Library, RealOutliers,
                         testing::Values("dubrovnik-16-22106-pre.txt",
                                         "trafalgar-21-11315-pre.txt"),
                         [](const auto& info) {
                           const std::string name = info.param;
                           return name.substr(0, name.find('-'));
                         });

}  // namespace
}  // namespace sheaf
