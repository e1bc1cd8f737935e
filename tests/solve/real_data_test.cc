// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sheaf/io.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

struct Known {
  const char* name;
  double optimum;
  double relative;  ///< how near
  int iterations;
  /// How far the scaled gradient falls by then: ladybug-49 still creeps down its valley.
  double gradient;
};

class RealData : public testing::TestWithParam<Known> {};

TEST_P(RealData, ReachesTheKnownOptimum) {
  const Known& known = GetParam();
  const std::string path = real_data(known.name);
  if (path.empty()) GTEST_SKIP() << known.name << " is not in $SHEAF_DATA/bal";
  Problem problem = read(path).value();
  const double gradient = scaled_gradient(problem, {}, 5);
  SolveOptions options;
  options.tolerance = 1e-13;
  options.max_iterations = known.iterations;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable()) << s.words;
  EXPECT_LE(s.final_cost, known.optimum * (1 + known.relative));
  const double plain = evaluate(problem).cost;
  EXPECT_NEAR(s.final_cost, plain, 1e-12 * plain);
  EXPECT_LT(scaled_gradient(problem, {}, 5), known.gradient * gradient);
}

INSTANTIATE_TEST_SUITE_P(
    Library, RealData,
    testing::Values(Known{"dubrovnik-16-22106-pre.txt", 18033.9035, 1e-7, 50, 1e-5},
                    Known{"trafalgar-21-11315-pre.txt", 30378.636, 1e-6, 50, 1e-4},
                    Known{"ladybug-49-7776-pre.txt", 13345, 0, 100, 1e-2}),
    [](const auto& info) {
      const std::string name = info.param.name;
      return name.substr(0, name.find('-'));
    });

/// Steps are what inner iterations are for: without them ladybug-49 takes twice as many.
TEST(RealData, FewStepsLeadNearTheOptimum) {
  struct Near {
    const char* name;
    double cost;
    int steps;
  };
  for (const Near& near : {Near{"dubrovnik-16-22106-pre.txt", 18033.9035 * (1 + 1e-6), 4},
                           Near{"trafalgar-21-11315-pre.txt", 30378.636 * (1 + 1e-6), 4},
                           Near{"ladybug-49-7776-pre.txt", 13344.2413 * (1 + 1e-3), 5}}) {
    const std::string path = real_data(near.name);
    if (path.empty()) GTEST_SKIP() << near.name << " is not in $SHEAF_DATA/bal";
    Problem problem = read(path).value();
    SolveOptions options;
    options.max_iterations = near.steps;
    EXPECT_LE(solve(problem, options).final_cost, near.cost) << near.name;
  }
}

TEST(RealData, ADoglegReachesTheKnownOptimumWithEverySolver) {
  struct Optimum {
    const char* name;
    double cost;
  };
  for (const Optimum& known : {Optimum{"dubrovnik-16-22106-pre.txt", 18033.90348 * (1 + 1e-9)},
                               Optimum{"trafalgar-21-11315-pre.txt", 30378.6358 * (1 + 1e-9)},
                               Optimum{"ladybug-49-7776-pre.txt", 13352}}) {
    const std::string path = real_data(known.name);
    if (path.empty()) GTEST_SKIP() << known.name << " is not in $SHEAF_DATA/bal";
    const Problem start = read(path).value();
    SolveOptions options;
    options.trust_region = TrustRegion::dogleg;
    for (CameraSolverKind solver :
         {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
          CameraSolverKind::iterative_implicit}) {
      options.solver = solver;
      Problem problem = start;
      const Summary s = solve(problem, options);
      EXPECT_LT(s.final_cost, known.cost) << known.name << " " << s.solver;
    }
  }
}

// From hardly any damping the first steps of ladybug-49 are rejected. A shorter step on the
// dogleg's path finds its way where more damping ends in a worse valley, at 14109.
TEST(RealData, ADoglegRecoversFromTooLittleDamping) {
  const std::string path = real_data("ladybug-49-7776-pre.txt");
  if (path.empty()) GTEST_SKIP() << "ladybug-49 is not in $SHEAF_DATA/bal";
  Problem problem = read(path).value();
  SolveOptions options;
  options.trust_region = TrustRegion::dogleg;
  options.initial_damping = 1e-6;
  const Summary s = solve(problem, options);
  EXPECT_LT(s.final_cost, 13352);
  EXPECT_TRUE(std::any_of(s.iterations.begin(), s.iterations.end(),
                          [](const Iteration& it) { return it.accepted && it.reused; }));
}

TEST(RealData, RejectNeverPutsMoreBehind) {
  const std::string path = real_data("ladybug-49-7776-pre.txt");
  if (path.empty()) GTEST_SKIP() << "ladybug-49 is not in $SHEAF_DATA/bal";
  Problem problem = read(path).value();
  SolveOptions options;
  options.cheirality = Cheirality::reject;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.behind_camera_before.size(), 31u);
  EXPECT_TRUE(std::includes(s.behind_camera_before.begin(), s.behind_camera_before.end(),
                            s.behind_camera_after.begin(), s.behind_camera_after.end()));
  EXPECT_EQ(s.behind_camera_after, evaluate(problem).behind);
  EXPECT_LT(s.final_cost, 0.2 * s.initial_cost);
}

TEST(RealData, HoldOutLeavesThe31Out) {
  const std::string path = real_data("ladybug-49-7776-pre.txt");
  if (path.empty()) GTEST_SKIP() << "ladybug-49 is not in $SHEAF_DATA/bal";
  Problem problem = read(path).value();
  SolveOptions options;
  options.cheirality = Cheirality::hold_out;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.rejected_observations.size(), 31u);
  EXPECT_LT(s.final_cost, 13345);
}

}  // namespace
}  // namespace sheaf
