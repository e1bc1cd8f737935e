// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/solve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "sheaf/scene.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool same_bits(const Pose& a, const Pose& b) { return std::memcmp(&a, &b, sizeof(Pose)) == 0; }

std::vector<double> all_parameters(const Problem& problem) {
  std::vector<double> out;
  for (const Camera& c : problem.cameras)
    out.insert(out.end(), c.parameters.begin(), c.parameters.end());
  return out;
}

bool same_state(const Problem& a, const Problem& b) {
  return same_bits(a.poses, b.poses) && same_bits(a.points, b.points) &&
         same_bits(all_parameters(a), all_parameters(b));
}

/// The cost that the truth leaves: what is due to noise alone.
double cost_of_truth(const Scene& scene) {
  Problem truth = scene.truth;
  truth.observation_xy = scene.start.observation_xy;
  return evaluate(truth).cost;
}

TEST(Solve, ReachesWhatTheNoiseLeaves) {
  const Scene scene = small_scene();
  Problem problem = scene.start;
  const Summary summary = solve(problem);
  EXPECT_EQ(summary.termination, Termination::cost_converged);
  // Least squares fits n parameters to the noise: E[cost] = (rows - n) / 2 sigma^2.
  const double truth = cost_of_truth(scene);
  const double rows = 2.0 * static_cast<double>(problem.num_observations());
  const double n = static_cast<double>(9 * problem.num_images() + problem.points.size() - 7);
  const double expected = (rows - n) / 2 * 0.5 * 0.5;
  EXPECT_LT(summary.final_cost, truth);
  EXPECT_NEAR(summary.final_cost, expected, 5 * std::sqrt((rows - n) / 2) * 0.5 * 0.5);
}

TEST(Solve, SummaryTellsWhatHappened) {
  const Scene scene = small_scene();
  Problem problem = scene.start;
  SolveOptions options;
  options.threads = 2;
  const Summary s = solve(problem, options);
  const Evaluation before = evaluate(scene.start), after = evaluate(problem);
  EXPECT_NEAR(s.initial_cost, before.cost, 1e-12 * before.cost);
  EXPECT_NEAR(s.final_cost, after.cost, 1e-12 * after.cost);
  EXPECT_NEAR(s.initial_rms_px, before.rms_px, 1e-12 * before.rms_px);
  EXPECT_NEAR(s.final_rms_px, after.rms_px, 1e-12 * after.rms_px);
  EXPECT_FALSE(s.words.empty());
  EXPECT_FALSE(s.solver.empty());
  EXPECT_FALSE(s.solver_reason.empty());
  EXPECT_FALSE(s.simd.empty());
  EXPECT_EQ(s.precision, "double");
  EXPECT_EQ(s.threads, 2);
  EXPECT_GT(s.forecast_bytes, 8 * problem.points.size());
  EXPECT_GT(s.setup_s, 0);
  EXPECT_GT(s.solve_s, 0);
  EXPECT_TRUE(s.behind_camera_before.empty());
  EXPECT_TRUE(s.rejected_observations.empty());
  ASSERT_GE(s.iterations.size(), 3u);
  EXPECT_EQ(s.iterations.front().cost, s.initial_cost);
  EXPECT_EQ(s.iterations.back().cost, s.final_cost);
  for (const Iteration& it : s.iterations) {
    EXPECT_GT(it.damping, 0);
    EXPECT_GT(it.gradient_max, 0);
    if (it.index == 0) continue;
    EXPECT_GT(it.step_norm, 0);
    if (it.accepted) {
      EXPECT_GT(it.gain_ratio, 0);
    }
  }
}

TEST(Solve, GradientVanishesByFiniteDifferences) {
  Problem problem = small_scene().start;
  const double before = scaled_gradient(problem);
  SolveOptions options;
  options.tolerance = 1e-15;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable()) << s.words;
  EXPECT_LT(scaled_gradient(problem), 1e-5 * before);
}

TEST(Solve, GradientOfTheSummaryIsTheOneOfFiniteDifferences) {
  // The summary's figure has points eliminated: with points held the two say the same, up to the
  // second derivatives of the residuals, which the finite differences of the cost contain.
  Problem problem = small_scene().start;
  SolveOptions options;
  options.max_iterations = 0;
  options.fixed.points = true;
  const double expected = scaled_gradient(problem, options.fixed);
  const Summary s = solve(problem, options);
  EXPECT_NEAR(s.iterations[0].gradient_max, expected, 0.1 * expected);
}

struct Holding {
  const char* name;
  Fixed fixed;
};

class Held : public testing::TestWithParam<Holding> {};

TEST_P(Held, DoesNotMoveByABitAndTheRestConverges) {
  const Fixed& fixed = GetParam().fixed;
  Scene scene = small_scene();
  // What is held stands at the truth, so that the noise's level can be reached.
  Problem problem = scene.start;
  if (fixed.points) problem.points = scene.truth.points;
  if (fixed.poses) problem.poses = scene.truth.poses;
  for (std::uint32_t i : fixed.pose_ids) problem.poses[i] = scene.truth.poses[i];
  for (std::size_t i = 0; i < problem.cameras.size(); ++i)
    if (fixed.f) problem.cameras[i] = scene.truth.cameras[i];
  for (std::uint32_t i : fixed.camera_ids) problem.cameras[i] = scene.truth.cameras[i];
  const Problem before = problem;
  SolveOptions options;
  options.fixed = fixed;
  options.tolerance = 1e-14;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable()) << s.words;
  EXPECT_LT(s.final_cost, cost_of_truth(scene));
  EXPECT_LT(scaled_gradient(problem, fixed), 1e-4 * scaled_gradient(before, fixed));

  EXPECT_EQ(same_bits(problem.points, before.points), fixed.points);
  const auto listed = [](const std::vector<std::uint32_t>& ids, std::uint32_t i) {
    return std::find(ids.begin(), ids.end(), i) != ids.end();
  };
  for (std::uint32_t i = 0; i < problem.num_images(); ++i) {
    EXPECT_EQ(same_bits(problem.poses[i], before.poses[i]),
              fixed.poses || listed(fixed.pose_ids, i))
        << "pose " << i;
    const bool all[3] = {fixed.f, fixed.k1, fixed.k2};
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(problem.cameras[i].parameters[k] == before.cameras[i].parameters[k],
                all[k] || listed(fixed.camera_ids, i))
          << "camera " << i << " parameter " << k;
  }
  EXPECT_TRUE(same_bits(problem.observation_xy, before.observation_xy));
}

Fixed holding(bool points, bool poses, bool intrinsics) {
  Fixed fixed;
  fixed.points = points;
  fixed.poses = poses;
  fixed.f = fixed.k1 = fixed.k2 = intrinsics;
  return fixed;
}

Fixed single_ones() {
  Fixed fixed;
  fixed.pose_ids = {0, 3};
  fixed.camera_ids = {5};
  return fixed;
}

Fixed distortion() {
  Fixed fixed;
  fixed.k1 = fixed.k2 = true;
  return fixed;
}

INSTANTIATE_TEST_SUITE_P(Solve, Held,
                         testing::Values(Holding{"PosesOnly", holding(true, false, true)},
                                         Holding{"PosesAndIntrinsics", holding(true, false, false)},
                                         Holding{"PointsOnly", holding(false, true, true)},
                                         Holding{"PointsAndIntrinsics",
                                                 holding(false, true, false)},
                                         Holding{"PointsAndPoses", holding(false, false, true)},
                                         Holding{"IntrinsicsOnly", holding(true, true, false)},
                                         Holding{"SinglePosesAndCameras", single_ones()},
                                         Holding{"Distortion", distortion()}),
                         [](const auto& info) { return info.param.name; });

TEST(Solve, EverythingHeldIsAlreadyAMinimum) {
  Problem problem = small_scene().start;
  const Problem before = problem;
  SolveOptions options;
  options.fixed = holding(true, true, true);
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::nothing_free);
  EXPECT_EQ(s.final_cost, s.initial_cost);
  EXPECT_TRUE(same_state(problem, before));
}

TEST(Solve, ThreadsDoNotChangeABit) {
  SceneOptions scene;
  scene.images = 40;
  scene.points = 9000;
  scene.mean_track = 5;
  const Problem start = generate(scene).value().start;
  for (bool points_held : {false, true}) {
    SolveOptions options;
    options.fixed.points = points_held;
    options.max_iterations = 6;
    Problem expected = start;
    options.threads = 1;
    const Summary reference = solve(expected, options);
    EXPECT_LT(reference.final_cost, reference.initial_cost);
    for (int threads : {2, 5, 16}) {
      Problem problem = start;
      options.threads = threads;
      const Summary s = solve(problem, options);
      EXPECT_TRUE(same_state(problem, expected)) << threads << " threads";
      ASSERT_EQ(s.iterations.size(), reference.iterations.size());
      for (std::size_t i = 0; i < s.iterations.size(); ++i) {
        EXPECT_EQ(s.iterations[i].cost, reference.iterations[i].cost);
        EXPECT_EQ(s.iterations[i].gradient_max, reference.iterations[i].gradient_max);
        EXPECT_EQ(s.iterations[i].step_norm, reference.iterations[i].step_norm);
      }
    }
  }
}

TEST(Solve, InstructionSetsAgree) {
  const Problem start = small_scene().start;
  SolveOptions options;
  options.tolerance = 1e-14;
  Problem best = start;
  const Summary reference = solve(best, options);
  std::vector<Problem> fused;
  for (Simd simd : {Simd::scalar, Simd::sse4, Simd::avx2, Simd::avx512, Simd::neon}) {
    Problem problem = start;
    options.simd = simd;
    const Result<Summary> s = try_solve(problem, options);
    if (!s.ok()) {  // not on this machine
      EXPECT_EQ(s.error().code(), ErrorCode::usage);
      continue;
    }
    EXPECT_NEAR(s.value().final_cost, reference.final_cost, 1e-9 * reference.final_cost);
    if (simd == Simd::avx2 || simd == Simd::avx512) fused.push_back(problem);
  }
  if (fused.size() == 2) {
    EXPECT_TRUE(same_state(fused[0], fused[1])) << "avx2 and avx512 differ";
  }
}

TEST(Solve, ImagesMayShareALens) {
  // Lenses shared in pairs or by all; the left-over ones gone or still in the problem.
  for (std::uint32_t together : {2u, 12u})
    for (bool keep_unused : {false, true})
      for (bool points_held : {false, true}) {
        SCOPED_TRACE(testing::Message() << together << keep_unused << points_held);
        const Scene scene = shared_lens_scene(together, keep_unused);
        Problem problem = scene.start;
        if (points_held) problem.points = scene.truth.points;
        const Problem before = problem;
        SolveOptions options;
        options.fixed.points = points_held;
        options.tolerance = 1e-14;
        const Summary s = solve(problem, options);
        EXPECT_TRUE(s.usable());
        EXPECT_LT(s.final_cost, cost_of_truth(scene));
        EXPECT_LT(scaled_gradient(problem, options.fixed),
                  1e-5 * scaled_gradient(before, options.fixed));
        // Gauss-Newton's model of a small step is exact where lens and pose couple as they should.
        EXPECT_LE(s.iterations.size(), 16u);
        for (std::size_t i = problem.image_camera.back() + 1; i < problem.cameras.size(); ++i)
          EXPECT_EQ(problem.cameras[i].parameters, before.cameras[i].parameters);
      }
}

TEST(Solve, APointMayBeSeenTwiceByOneImage) {
  Problem problem = small_scene().start;
  for (std::size_t i = 0; i < 400; i += 7) {
    const double x = problem.observation_xy[2 * i], y = problem.observation_xy[2 * i + 1];
    problem.add_observation(problem.observation_image[i], problem.observation_point[i], x + 0.4,
                            y - 0.3);
  }
  const double before = scaled_gradient(problem);
  SolveOptions options;
  options.tolerance = 1e-15;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable());
  EXPECT_LT(scaled_gradient(problem), 1e-5 * before);
}

TEST(Solve, OddPointsAndImagesDoNoHarm) {
  const Scene scene = small_scene();
  Problem plain = scene.start;
  SolveOptions options;
  options.tolerance = 1e-13;
  const Summary expected = solve(plain, options);

  Problem problem = scene.start;
  const std::uint32_t unseen = problem.add_point(1.5, -2.25, 1e9);
  const std::uint32_t once =
      problem.add_point(problem.points[0] + 0.01, problem.points[1], problem.points[2]);
  problem.add_observation(problem.observation_image[0], once, problem.observation_xy[0] + 5,
                          problem.observation_xy[1]);
  const Camera blind_lens{CameraModel::bal, {500, -0.1, 0.01}};
  const std::uint32_t blind = problem.add_image(problem.poses[2], blind_lens);
  problem.bal_angle_axis.clear();
  const Problem before = problem;
  const Summary s = solve(problem, options);
  // One observation gives its point two of three freedoms: it fits, and changes nothing else.
  EXPECT_NEAR(s.final_cost, expected.final_cost, 1e-6 * expected.final_cost);
  EXPECT_EQ(std::memcmp(&problem.points[3 * unseen], &before.points[3 * unseen], 24), 0);
  for (double x : problem.points) ASSERT_TRUE(std::isfinite(x));
  EXPECT_EQ(problem.poses[blind].translation, before.poses[blind].translation);
  EXPECT_EQ(problem.cameras[blind].parameters, before.cameras[blind].parameters);
  for (int k = 0; k < 4; ++k)
    EXPECT_NEAR(problem.poses[blind].rotation[k], before.poses[blind].rotation[k], 1e-15);
}

TEST(Solve, RefusesWhatMakesNoSense) {
  const auto refused = [](const Problem& problem, const SolveOptions& options) {
    Problem copy = problem;
    const Result<Summary> result = try_solve(copy, options);
    if (result.ok()) return std::string("accepted");
    EXPECT_EQ(result.error().code(), ErrorCode::usage);
    EXPECT_THROW((void)solve(copy, options), Error);
    EXPECT_TRUE(same_state(copy, problem));
    return std::string(result.error().what());
  };
  const auto with = [](auto change) {
    SolveOptions options;
    change(options);
    return options;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refused(Problem(), {}).find("observation"), std::string::npos);
  const Problem good = small_scene().start;
  for (const auto& [options, word] : std::vector<std::pair<SolveOptions, std::string>>{
           {with([](auto& o) { o.max_iterations = -1; }), "max_iterations"},
           {with([](auto& o) { o.tolerance = -1; }), "tolerance"},
           {with([&](auto& o) { o.tolerance = nan; }), "tolerance"},
           {with([&](auto& o) { o.gradient_tolerance = nan; }), "gradient_tolerance"},
           {with([&](auto& o) { o.time_limit_s = nan; }), "time_limit"},
           {with([](auto& o) { o.initial_damping = -1; }), "initial_damping"},
           {with([](auto& o) {
              o.trust_region = TrustRegion::dogleg;
              o.points = PointParametrisation::homogeneous;
            }),
            "dogleg"},
           {with([](auto& o) { o.inner_iterations = -1; }), "inner_iterations"},
           {with([](auto& o) { o.threads = -1; }), "threads"},
           {with([](auto& o) { o.fixed.pose_ids = {99}; }), "pose 99"},
           {with([](auto& o) { o.fixed.camera_ids = {98}; }), "camera 98"}})
    EXPECT_NE(refused(good, options).find(word), std::string::npos)
        << word << ": " << refused(good, options);
  Problem bad = good;
  bad.observation_point[3] = 1000000;
  EXPECT_NE(refused(bad, {}).find("observation 3"), std::string::npos);
  bad = good;
  bad.points[4] = nan;
  EXPECT_NE(refused(bad, {}).find("point 1"), std::string::npos);
}

TEST(Solve, ALongTrackOfManyChunksConverges) {
  Problem problem = small_scene().start;
  const std::size_t n = problem.num_observations();
  for (int i = 0; i < 3000; ++i) {  // the first point is seen 3000 times over, half a pixel apart
    const std::size_t of = static_cast<std::size_t>(i) % 2;
    problem.add_observation(problem.observation_image[of], problem.observation_point[of],
                            problem.observation_xy[2 * of] + 0.5 * (i % 3 - 1),
                            problem.observation_xy[2 * of + 1]);
  }
  ASSERT_EQ(problem.num_observations(), n + 3000);
  const double before = scaled_gradient(problem);
  SolveOptions options;
  options.tolerance = 1e-15;
  EXPECT_TRUE(solve(problem, options).usable());
  EXPECT_LT(scaled_gradient(problem), 1e-4 * before);
}

TEST(Solve, TheCallbackSeesFallingCostsAndStops) {
  Problem problem = small_scene().start;
  SolveOptions options;
  std::vector<double> costs;
  options.on_iteration = [&](const Iteration& it) {
    EXPECT_EQ(static_cast<std::size_t>(it.index), costs.size());
    costs.push_back(it.cost);
    return it.index < 2;
  };
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::stopped);
  ASSERT_EQ(costs.size(), 3u);
  EXPECT_GE(costs[0], costs[1]);
  EXPECT_GE(costs[1], costs[2]);
  EXPECT_LT(costs[2], costs[0]);
  // The best state so far is stored.
  EXPECT_NEAR(evaluate(problem).cost, costs[2], 1e-12 * costs[2]);
}

TEST(Solve, NoIterationsChangeNothing) {
  Problem problem = small_scene().start;
  const Problem before = problem;
  SolveOptions options;
  options.max_iterations = 0;
  const Summary s = solve(problem, options);
  EXPECT_EQ(s.termination, Termination::max_iterations);
  EXPECT_EQ(s.final_cost, s.initial_cost);
  EXPECT_TRUE(same_state(problem, before));
}

TEST(Solve, ASolvedProblemIsSuccess) {
  Problem problem = small_scene().start;
  SolveOptions options;
  options.tolerance = 1e-14;
  const Summary first = solve(problem, options);
  const Summary second = solve(problem, options);
  EXPECT_TRUE(second.usable()) << second.words;
  EXPECT_LE(second.final_cost, first.final_cost * (1 + 1e-12));
}

TEST(Solve, AnyInitialDampingReachesTheSameMinimum) {
  const Problem start = small_scene().start;
  Problem reference = start;
  SolveOptions options;
  options.tolerance = 1e-13;
  options.max_iterations = 200;
  const double expected = solve(reference, options).final_cost;
  for (double damping : {1e-12, 1e-3, 1e3}) {
    Problem problem = start;
    options.initial_damping = damping;
    const Summary s = solve(problem, options);
    EXPECT_EQ(s.iterations[0].damping, damping);
    EXPECT_NEAR(s.final_cost, expected, 1e-9 * expected) << damping;
  }
}

}  // namespace
}  // namespace sheaf
