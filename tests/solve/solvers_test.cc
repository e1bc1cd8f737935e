// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Every camera solver reaches what the dense one reaches, on scenes with every oddity.
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

struct Case {
  CameraSolverKind solver;
  const char* name;
  Precision precision = Precision::full;
};

class Solvers : public testing::TestWithParam<Case> {
 protected:
  static SolveOptions tight() {
    SolveOptions options;
    options.tolerance = 1e-13;
    options.max_iterations = 200;
    return options;
  }

  void expect_same_optimum(const Problem& start, const Fixed& fixed = {}, const Loss& loss = {}) {
    SolveOptions options = tight();
    options.fixed = fixed;
    options.loss = loss;
    options.solver = CameraSolverKind::dense;
    options.precision = Precision::full;
    Problem reference = start;
    const double expected = solve(reference, options).final_cost;
    options.solver = GetParam().solver;
    options.precision = GetParam().precision;
    Problem problem = start;
    const Summary s = solve(problem, options);
    EXPECT_TRUE(s.usable()) << s.words;
    EXPECT_NEAR(s.final_cost, expected, 1e-8 * expected);
    const ScaledLoss scaled{loss.kind, loss.scale_px};
    EXPECT_LT(scaled_gradient(problem, fixed, 40, scaled),
              1e-3 * scaled_gradient(start, fixed, 40, scaled));
  }
};

Fixed points_held() {
  Fixed fixed;
  fixed.points = true;
  return fixed;
}

TEST_P(Solvers, AgreeOnAScene) {
  const Scene scene = small_scene();
  expect_same_optimum(scene.start);
  Fixed distortion;
  distortion.k1 = distortion.k2 = true;
  distortion.pose_ids = {3};
  expect_same_optimum(scene.start, distortion);
  Problem on_true_points = scene.start;
  on_true_points.points = scene.truth.points;
  expect_same_optimum(on_true_points, points_held());
}

TEST_P(Solvers, AgreeWithADogleg) {
  const Scene scene = small_scene();
  const auto expect_same = [](const Problem& start, SolveOptions options) {
    options.tolerance = 1e-13;
    options.max_iterations = 200;
    Problem reference = start;
    const double expected = solve(reference, options).final_cost;
    options.solver = GetParam().solver;
    options.precision = GetParam().precision;
    options.trust_region = TrustRegion::dogleg;
    for (double damping : {0.0, 1e-9}) {
      options.initial_damping = damping;
      Problem problem = start;
      const Summary s = solve(problem, options);
      EXPECT_TRUE(s.usable()) << s.words;
      EXPECT_NEAR(s.final_cost, expected, 1e-8 * expected);
    }
  };
  SolveOptions options;
  expect_same(scene.start, options);
  options.loss = Huber{1};
  expect_same(scene.start, options);
  options.fixed.pose_ids = {3};
  options.fixed.k1 = true;
  expect_same(scene.start, options);
  Problem on_true_points = scene.start;
  on_true_points.points = scene.truth.points;
  options.fixed = points_held();
  expect_same(on_true_points, options);
  expect_same(shared_lens_scene(2, false).start, {});
}

TEST_P(Solvers, AgreeWithALoss) {
  const Scene scene = small_scene();
  expect_same_optimum(scene.start, {}, Huber{1});
  expect_same_optimum(scene.start, {}, Cauchy{1});
  Problem on_true_points = scene.start;
  on_true_points.points = scene.truth.points;
  expect_same_optimum(on_true_points, points_held(), Huber{1});
}

// The end would be the same with weights left out of the floats, as the last steps are in double;
// the first one would not.
TEST_P(Solvers, StepAlikeInEitherPrecisionWithALoss) {
  SolveOptions options;
  options.solver = GetParam().solver;
  options.inner_iterations = 0;
  options.max_iterations = 1;
  for (const Loss& loss : {Loss(Huber{0.5}), Loss(Cauchy{0.5})}) {
    options.loss = loss;
    double cost[2] = {0, 0};
    for (Precision precision : {Precision::full, GetParam().precision}) {
      options.precision = precision;
      Problem problem = small_scene().start;
      const Summary s = solve(problem, options);
      cost[precision == Precision::full ? 0 : 1] = s.iterations.back().trial_cost;
      EXPECT_LT(s.final_cost, s.initial_cost);
    }
    if (GetParam().precision != Precision::full) {
      EXPECT_NEAR(cost[1], cost[0], 1e-4 * cost[0]);
    }
  }
}

TEST_P(Solvers, AgreeOnSharedLenses) {
  for (std::uint32_t together : {2u, 12u})
    for (bool keep_unused : {false, true}) {
      Scene scene = shared_lens_scene(together, keep_unused);
      expect_same_optimum(scene.start);
      scene.start.points = scene.truth.points;
      expect_same_optimum(scene.start, points_held());
    }
}

TEST_P(Solvers, AgreeWhereOneImageSeesAPointTwice) {
  Problem problem = small_scene().start;
  for (std::size_t i = 0; i < 400; i += 7)
    problem.add_observation(problem.observation_image[i], problem.observation_point[i],
                            problem.observation_xy[2 * i] + 0.4, problem.observation_xy[2 * i + 1]);
  expect_same_optimum(problem);
}

TEST_P(Solvers, GiveTheSameBitsOnAnyThreads) {
  SceneOptions scene;
  scene.images = 40;
  scene.points = 9000;
  scene.mean_track = 5;
  const Problem start = generate(scene).value().start;
  SolveOptions options;
  options.solver = GetParam().solver;
  options.precision = GetParam().precision;
  options.max_iterations = 4;
  for (const Loss& loss : {Loss(), Loss(Cauchy())}) {
    options.loss = loss;
    options.threads = 1;
    Problem expected = start;
    const Summary reference = solve(expected, options);
    EXPECT_LT(reference.final_cost, reference.initial_cost);
    for (int threads : {2, 5, 16}) {
      options.threads = threads;
      Problem problem = start;
      EXPECT_EQ(solve(problem, options).final_cost, reference.final_cost) << threads << " threads";
      EXPECT_EQ(problem.points, expected.points) << threads << " threads";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Camera, Solvers,
    testing::Values(Case{CameraSolverKind::dense, "Dense"},
                    Case{CameraSolverKind::iterative, "Iterative"},
                    Case{CameraSolverKind::iterative_explicit, "Explicit"},
                    Case{CameraSolverKind::iterative_implicit, "Implicit"},
                    Case{CameraSolverKind::iterative_explicit, "ExplicitMixed", Precision::mixed},
                    Case{CameraSolverKind::iterative_implicit, "ImplicitMixed", Precision::mixed}),
    [](const auto& info) { return info.param.name; });

/// Long enough for a coarse space of some twenty clusters.
Problem street() {
  FamilyOptions options;
  options.family = SceneFamily::street;
  options.images = 160;
  options.points = 9000;
  options.observations = 38000;
  return generate(options).value().start;
}

class LongStreet : public testing::TestWithParam<Case> {};

TEST_P(LongStreet, TakesFewIterationsAndTheSameSteps) {
  const Problem start = street();
  SolveOptions options;
  options.max_iterations = 7;
  options.solver = CameraSolverKind::dense;
  Problem reference = start;
  const double expected = solve(reference, options).final_cost;
  options.solver = GetParam().solver;
  Problem problem = start;
  const Summary s = solve(problem, options);
  EXPECT_NEAR(s.final_cost, expected, 2e-3 * expected);
  int iterations = 0;
  for (const Iteration& it : s.iterations) iterations += it.linear_iterations;
  // With the diagonal blocks alone 7 steps of a street of 138 images took 427.
  EXPECT_LE(iterations, 130);
}

TEST_P(LongStreet, HoldsPosesAndSharesLenses) {
  Problem problem = street();
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    problem.image_camera[i] = static_cast<std::uint32_t>(i < 100 ? i % 3 : i);
  SolveOptions options;
  options.max_iterations = 6;
  for (std::uint32_t i = 40; i < 80; ++i) options.fixed.pose_ids.push_back(i);
  options.solver = CameraSolverKind::dense;
  Problem reference = problem;
  const double expected = solve(reference, options).final_cost;
  options.solver = GetParam().solver;
  const Problem start = problem;
  EXPECT_NEAR(solve(problem, options).final_cost, expected, 5e-3 * expected);
  for (std::uint32_t i = 40; i < 80; ++i)
    EXPECT_EQ(problem.poses[i].translation, start.poses[i].translation) << i;
}

TEST_P(LongStreet, GivesTheSameBitsOnAnyThreads) {
  const Problem start = street();
  SolveOptions options;
  options.solver = GetParam().solver;
  options.max_iterations = 3;
  options.threads = 1;
  Problem expected = start;
  const Summary reference = solve(expected, options);
  for (int threads : {2, 5}) {
    options.threads = threads;
    Problem problem = start;
    EXPECT_EQ(solve(problem, options).final_cost, reference.final_cost) << threads << " threads";
    EXPECT_EQ(problem.points, expected.points) << threads << " threads";
  }
}

INSTANTIATE_TEST_SUITE_P(Camera, LongStreet,
                         testing::Values(Case{CameraSolverKind::iterative_explicit, "Explicit"},
                                         Case{CameraSolverKind::iterative_implicit, "Implicit"}),
                         [](const auto& info) { return info.param.name; });

/// The scene with its first point seen `times` more, half a pixel apart.
Problem with_long_track(int times) {
  Problem problem = small_scene().start;
  for (int i = 0; i < times; ++i) {
    const std::size_t of = static_cast<std::size_t>(i) % 2;
    problem.add_observation(problem.observation_image[of], problem.observation_point[of],
                            problem.observation_xy[2 * of] + 0.5 * (i % 3 - 1),
                            problem.observation_xy[2 * of + 1]);
  }
  return problem;
}

// Beyond what the 16-bit record numbers of a chunk can tell apart.
TEST(OverlongTrack, IsSolvedOrRefusedNeverMiscounted) {
  const Problem start = with_long_track(9000);
  for (bool held : {false, true})
    for (const Case& c : {Case{CameraSolverKind::automatic, "automatic"},
                          Case{CameraSolverKind::iterative, "iterative"},
                          Case{CameraSolverKind::iterative_implicit, "implicit"},
                          Case{CameraSolverKind::iterative_explicit, "explicit"},
                          Case{CameraSolverKind::dense, "dense"}}) {
      SCOPED_TRACE(std::string(c.name) + (held ? ", points held" : ""));
      SolveOptions options;
      options.tolerance = 1e-13;
      options.max_iterations = 100;
      options.solver = c.solver;
      options.fixed.points = held;
      Problem problem = start;
      const Result<Summary> s = try_solve(problem, options);
      if (!s.ok()) {  // said, and nothing was touched
        EXPECT_EQ(s.error().code(), ErrorCode::usage);
        EXPECT_NE(std::string(s.error().what()).find("90"), std::string::npos) << s.error().what();
        EXPECT_EQ(problem.points, start.points);
        EXPECT_TRUE(c.solver == CameraSolverKind::dense ||
                    c.solver == CameraSolverKind::iterative_explicit)
            << s.error().what();
        continue;
      }
      if (c.solver == CameraSolverKind::automatic && !held) {
        EXPECT_EQ(s.value().solver, "iterative-implicit");
        EXPECT_NE(s.value().solver_reason.find("too often"), std::string::npos);
      }
      EXPECT_LT(scaled_gradient(problem, options.fixed, 5),
                1e-3 * scaled_gradient(start, options.fixed, 5));
    }
}

/// Images by themselves against the whole machinery with a camera matrix: the same steps.
TEST(PointsHeld, TakeTheStepsOfTheFullSystem) {
  Problem start = small_scene().start;
  start.points = small_scene().truth.points;
  Fixed lens = points_held(), some = points_held();
  lens.f = lens.k1 = lens.k2 = true;
  some.pose_ids = {2};
  some.camera_ids = {4};
  some.k2 = true;
  for (const Fixed& fixed : {points_held(), lens, some})
    for (const Loss& loss : {Loss(), Loss(Huber{1}), Loss(Cauchy{})}) {
      SolveOptions options;
      options.fixed = fixed;
      options.loss = loss;
      options.cheirality = Cheirality::reject;
      Problem apart = start, together = start;
      const Summary a = solve(apart, options);
      options.solver = CameraSolverKind::dense;
      const Summary b = solve(together, options);
      EXPECT_EQ(a.solver, "blocks");
      EXPECT_EQ(b.solver, "dense");
      const std::size_t steps = std::min(a.iterations.size(), b.iterations.size());
      EXPECT_GE(steps, 4u);
      for (std::size_t i = 0; i + 1 < steps; ++i) {
        EXPECT_NEAR(a.iterations[i].cost, b.iterations[i].cost, 1e-9 * b.iterations[i].cost);
        EXPECT_NEAR(a.iterations[i].gain_ratio, b.iterations[i].gain_ratio, 1e-3) << i;
      }
      EXPECT_NEAR(a.final_sigma_px, b.final_sigma_px, 1e-9);
      EXPECT_NEAR(a.final_plain_cost, b.final_plain_cost, 1e-9 * b.final_plain_cost);
      EXPECT_EQ(apart.points, start.points);
    }
}

TEST(PointsHeld, GiveTheSameBitsOnAnyThreads) {
  SceneOptions scene;
  scene.images = 40;
  scene.points = 9000;
  const Problem start = generate(scene).value().start;
  Problem first;
  for (int threads : {1, 2, 5}) {
    SolveOptions options;
    options.fixed = points_held();
    options.threads = threads;
    options.loss = Cauchy{};
    Problem problem = start;
    solve(problem, options);
    if (threads == 1) first = problem;
    for (std::size_t i = 0; i < start.num_images(); ++i) {
      EXPECT_EQ(problem.poses[i].rotation, first.poses[i].rotation);
      EXPECT_EQ(problem.poses[i].translation, first.poses[i].translation);
      EXPECT_EQ(problem.cameras[i].parameters, first.cameras[i].parameters);
    }
  }
}

}  // namespace
}  // namespace sheaf
