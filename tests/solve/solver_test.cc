// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A solver that stays against `solve`: the same bits, whatever the home, the loss and the lenses,
// with other measurements, states and switches each time.
#include "sheaf/solver.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "platform/random.h"
#include "sheaf/sheaf.h"
#include "solve/lens_problems.h"
#include "solve/rig_problems.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

constexpr double kOff = std::numeric_limits<double>::infinity();

/// A case: a problem, how it is solved, and whether its home can stay.
struct Case {
  std::string name;
  Problem problem;
  SolveOptions options{};
  bool stays = true;
};

/// Other numbers in the same structure: measurements, states, lenses, sigmas and switches.
void change(Problem& p, std::uint64_t seed) {
  Random random(seed);
  for (double& x : p.observation_xy) x += 0.1 * random.normal();
  for (double& x : p.points) x *= 1 + 1e-3 * random.normal();
  for (std::size_t i = 0; i < p.num_images(); ++i)
    if (!in_rig(p.rigs, i)) p.poses[i] = test::moved(p.poses[i], 1e-3, random);
  for (Pose& pose : p.rigs.rig_from_world) pose = test::moved(pose, 1e-3, random);
  for (Camera& camera : p.cameras) camera.parameters[0] *= 1 + 1e-3 * random.normal();
  for (double& sigma : p.observation_sigma) {
    sigma = 0.5 + random.uniform();
    if (random.uniform() < 0.1) sigma = kOff;
  }
}

void expect_equal(const Problem& found, const Problem& expected) {
  EXPECT_EQ(found.points, expected.points);
  for (std::size_t i = 0; i < expected.num_images(); ++i) {
    EXPECT_EQ(found.poses[i].rotation, expected.poses[i].rotation) << i;
    EXPECT_EQ(found.poses[i].translation, expected.poses[i].translation) << i;
  }
  for (std::size_t c = 0; c < expected.cameras.size(); ++c)
    EXPECT_EQ(found.cameras[c].parameters, expected.cameras[c].parameters) << c;
  for (std::size_t f = 0; f < expected.rigs.num_frames(); ++f)
    EXPECT_EQ(found.rigs.rig_from_world[f].translation,
              expected.rigs.rig_from_world[f].translation);
  for (std::size_t s = 0; s < expected.rigs.num_sensors(); ++s)
    EXPECT_EQ(found.rigs.sensor_from_rig[s].translation,
              expected.rigs.sensor_from_rig[s].translation);
}

void expect_equal(const Summary& found, const Summary& expected) {
  EXPECT_EQ(found.initial_cost, expected.initial_cost);
  EXPECT_EQ(found.final_cost, expected.final_cost);
  EXPECT_EQ(found.final_plain_cost, expected.final_plain_cost);
  EXPECT_EQ(found.initial_rms_px, expected.initial_rms_px);
  EXPECT_EQ(found.final_rms_px, expected.final_rms_px);
  EXPECT_EQ(found.final_terms.total(), expected.final_terms.total());
  EXPECT_EQ(found.final_sigma_px, expected.final_sigma_px);
  EXPECT_EQ(found.termination, expected.termination);
  EXPECT_EQ(found.words, expected.words);
  EXPECT_EQ(found.points, expected.points);
  EXPECT_EQ(found.points_reason, expected.points_reason);
  EXPECT_EQ(found.solver_reason, expected.solver_reason);
  EXPECT_EQ(found.rounds.size(), expected.rounds.size());
  EXPECT_EQ(found.behind_camera_before, expected.behind_camera_before);
  EXPECT_EQ(found.rejected_observations, expected.rejected_observations);
  ASSERT_EQ(found.iterations.size(), expected.iterations.size());
  for (std::size_t k = 0; k < expected.iterations.size(); ++k) {
    // Trial costs may be no numbers.
    EXPECT_EQ(std::bit_cast<std::uint64_t>(found.iterations[k].trial_cost),
              std::bit_cast<std::uint64_t>(expected.iterations[k].trial_cost))
        << k;
    EXPECT_EQ(found.iterations[k].damping, expected.iterations[k].damping) << k;
    EXPECT_EQ(found.iterations[k].linear_iterations, expected.iterations[k].linear_iterations);
  }
}

void expect_bits_of_solve(const Case& of) {
  SCOPED_TRACE(of.name);
  Solver solver(of.options);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    Problem expected = of.problem;
    if (seed > 0) change(expected, seed);
    Problem found = expected;
    SolveOptions fresh = of.options;
    fresh.threads = seed % 2 == 0 ? 1 : 2;
    const Summary by_solve = solve(expected, fresh);
    const Summary& by_solver = solver.solve(found);
    expect_equal(found, expected);
    expect_equal(by_solver, by_solve);
    EXPECT_EQ(solver.was_kept(), of.stays && seed > 0);
  }
}

Problem with_sigmas(Problem p) {
  p.observation_sigma.assign(p.num_observations(), 1);
  change(p, 17);
  return p;
}

SolveOptions few(int steps = 8) {
  SolveOptions options;
  options.max_iterations = steps;
  options.threads = 2;
  return options;
}

SolveOptions with(const std::function<void(SolveOptions&)>& set) {
  SolveOptions options = few();
  set(options);
  return options;
}

Problem through(CameraModel model, bool shared) {
  const std::vector<Camera> lenses(6, test::ordinary(model));
  Problem p = test::thinned(test::disturbed(lenses, 6, 30, 3), 4);
  if (!shared) return p;
  p.image_camera.assign(p.num_images(), 0);
  p.cameras.resize(1);
  return p;
}

TEST(Solver, HasTheBitsOfSolveWithEveryLoss) {
  const Problem scene = small_scene().start;
  expect_bits_of_solve({"none", scene, few()});
  for (const Loss& loss : {Loss(Huber{1}), Loss(Huber{}), Loss(SoftL1{2}), Loss(Cauchy{2, true}),
                           Loss(Tukey{kAutomaticScale, true}), Loss(GemanMcClure{3})})
    expect_bits_of_solve({to_string(loss.kind), scene, with([&](auto& o) { o.loss = loss; })});
  expect_bits_of_solve({"sigmas", with_sigmas(scene), few()});
  expect_bits_of_solve(
      {"sigmas, huber", with_sigmas(scene), with([](auto& o) { o.loss = Huber{}; })});
}

TEST(Solver, HasTheBitsOfSolveWithEverySolverAndChart) {
  const Problem scene = small_scene().start;
  for (const auto solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit})
    for (const auto precision : {Precision::full, Precision::mixed})
      expect_bits_of_solve(
          {"solver", scene, with([&](auto& o) { o.solver = solver, o.precision = precision; }),
           solver != CameraSolverKind::iterative_explicit || precision == Precision::full});
  for (const auto points : {PointParametrisation::homogeneous, PointParametrisation::inverse_depth})
    expect_bits_of_solve({"points", scene, with([&](auto& o) { o.points = points; })});
  expect_bits_of_solve(
      {"dogleg", scene, with([](auto& o) { o.trust_region = TrustRegion::dogleg; })});
  expect_bits_of_solve({"reject", scene, with([](auto& o) { o.cheirality = Cheirality::reject; })});
  expect_bits_of_solve({"plain", scene, with([](auto& o) { o.inner_iterations = 0; })});
  expect_bits_of_solve({"to the end", scene, few(50)});
  expect_bits_of_solve({"scalar", scene, with([](auto& o) { o.simd = Simd::scalar; })});
}

TEST(Solver, HasTheBitsOfSolveWithEveryLens) {
  for (const CameraModel model :
       {CameraModel::simple_pinhole, CameraModel::pinhole, CameraModel::simple_radial,
        CameraModel::opencv, CameraModel::opencv_fisheye})
    for (const bool shared : {false, true}) {
      const Problem p = through(model, shared);
      expect_bits_of_solve({std::string(to_string(model)), p, few()});
      expect_bits_of_solve({std::string(to_string(model)), with_sigmas(p), with([](auto& o) {
                              o.loss = Huber{1}, o.fixed.intrinsics = true;
                              o.fixed.pose_ids = {0, 1};
                            })});
    }
  expect_bits_of_solve({"mixture", test::mixtures().back(), few()});
}

TEST(Solver, HasTheBitsOfSolveWithRigsAndTerms) {
  test::RigScene rigs;
  expect_bits_of_solve({"rigs", test::rig_problem(rigs), few()});
  rigs.model = CameraModel::simple_radial, rigs.free_images = 2;
  Problem p = test::rig_problem(rigs);
  expect_bits_of_solve({"rigs, turned", with_sigmas(p), with([](auto& o) { o.loss = Huber{1}; })});
  p.terms.centres.push_back({1, {0.1, 0.2, -5}, kUnitCovariance3, {LossKind::huber, 1}});
  p.terms.points.push_back({3, {0, 0, 0}, {9, 0, 0, 0, 9, 0, 0, 0, 9}});
  p.terms.bounds.push_back({0, 0, 100, 2000});
  expect_bits_of_solve({"terms", p, few()});
  Problem scene = through(CameraModel::opencv, true);
  GaussianPrior prior;
  const Pose& pose = scene.poses[2];
  prior.blocks.push_back({GaussianPrior::Block::Kind::pose, 2, {}});
  prior.blocks[0].state.assign(pose.rotation.begin(), pose.rotation.end());
  prior.blocks[0].state.insert(prior.blocks[0].state.end(), pose.translation.begin(),
                               pose.translation.end());
  for (int k = 0; k < 36; ++k) prior.square_root.push_back(k % 7 == 0 ? 50 : 3);
  scene.terms.gaussians.push_back(prior);
  expect_bits_of_solve({"gaussian", scene, few()});
}

TEST(Solver, SolvesAfreshWhatCannotStay) {
  const Problem scene = small_scene().start;
  expect_bits_of_solve(
      {"hold out", scene, with([](auto& o) { o.cheirality = Cheirality::hold_out; }), false});
  expect_bits_of_solve({"memory limit", scene,
                        with([](auto& o) { o.memory_limit_bytes = std::uint64_t(1) << 34; }),
                        false});
  expect_bits_of_solve({"points held", scene, with([](auto& o) { o.fixed.points = true; }), false});
  Problem tied = scene;
  tied.terms.distances.push_back({0, 1, 1.5, 0.1, {}});
  expect_bits_of_solve({"kept points", tied, few(), false});
}

TEST(Solver, ArrangesAnewWhereTheStructureIsAnother) {
  Problem p = small_scene().start;
  Solver solver(few());
  const auto solved = [&] {
    Problem found = p, expected = p;
    solver.solve(found);
    solve(expected, few());
    expect_equal(found, expected);
    return solver.was_kept();
  };
  EXPECT_FALSE(solved());
  EXPECT_TRUE(solved());
  const double* X = p.points.data();
  p.add_observation(p.observation_image[0] == 3 ? 4 : 3, p.add_point(X[0], X[1], X[2]),
                    p.observation_xy[0], p.observation_xy[1]);
  EXPECT_FALSE(solved());
  EXPECT_TRUE(solved());
  p.terms.centres.push_back({1, {0, 0, 0}, {1e6, 0, 0, 0, 1e6, 0, 0, 0, 1e6}, {}, {}});
  EXPECT_FALSE(solved());
  EXPECT_TRUE(solved());
  p.terms.centres[0].position[0] = 1e-3;
  EXPECT_FALSE(solved());
  p.observation_sigma.assign(p.num_observations(), 2);
  EXPECT_FALSE(solved());
  p.observation_sigma[7] = kOff;
  EXPECT_TRUE(solved());
  solver.forget();
  EXPECT_FALSE(solved());
  solver.set_options(few());
  EXPECT_FALSE(solved());
  EXPECT_TRUE(solved());
}

TEST(Solver, TellsWhatIsWrongAndGoesOn) {
  const Problem good = small_scene().start;
  Problem p = good;
  Solver solver(few());
  solver.solve(p);
  p = good;
  p.points[4] = std::nan("");
  const Result<const Summary*> wrong = solver.try_solve(p);
  ASSERT_FALSE(wrong.ok());
  EXPECT_STREQ(wrong.error().what(), "point 1: a coordinate is not finite");
  EXPECT_THROW(solver.solve(p), Error);
  p = good;
  Problem expected = good;
  solver.solve(p);
  solve(expected, few());
  expect_equal(p, expected);
  Solver other(with([](auto& o) { o.tolerance = -1; }));
  EXPECT_EQ(other.try_solve(p).error().code(), ErrorCode::usage);
}

/// A problem, some of whose observations are switched off and absurd, and it without these.
std::pair<Problem, Problem> switched_off_and_gone() {
  Problem with_all = with_sigmas(small_scene().start), without = with_all;
  std::vector<std::uint32_t> images, points;
  std::vector<double> xy, sigma;
  for (std::size_t i = 0; i < with_all.num_observations(); ++i) {
    if (std::isinf(with_all.observation_sigma[i])) {
      with_all.observation_xy[2 * i] += 1e4;
      continue;
    }
    images.push_back(with_all.observation_image[i]);
    points.push_back(with_all.observation_point[i]);
    xy.insert(xy.end(), {with_all.observation_xy[2 * i], with_all.observation_xy[2 * i + 1]});
    sigma.push_back(with_all.observation_sigma[i]);
  }
  EXPECT_LT(images.size(), with_all.num_observations());
  without.observation_image = images, without.observation_point = points;
  without.observation_xy = xy, without.observation_sigma = sigma;
  return {with_all, without};
}

TEST(Solver, ASwitchedOffObservationIsAsGoodAsGone) {
  const auto [with_all, without] = switched_off_and_gone();
  for (const Loss& loss : {Loss{}, Loss(Huber{1}), Loss(Huber{})}) {
    SolveOptions options = few(60);
    options.loss = loss;
    options.tolerance = 1e-13;
    Problem a = with_all, b = without;
    const Summary of_a = solve(a, options), of_b = solve(b, options);
    EXPECT_NEAR(of_a.initial_cost, of_b.initial_cost, 1e-12 * of_b.initial_cost);
    // Where a scale settles is a matter of the way there.
    const double near =
        loss.kind != LossKind::none && loss.scale_px == kAutomaticScale ? 1e-4 : 1e-9;
    EXPECT_NEAR(of_a.final_cost, of_b.final_cost, near * of_b.final_cost);
    EXPECT_NEAR(of_a.final_sigma_px, of_b.final_sigma_px, near);
    EXPECT_NEAR(of_a.final_rms_px, of_b.final_rms_px, std::sqrt(near));
    EXPECT_NEAR(of_a.final_rms_px, evaluate(a).rms_px, 1e-12);
    EXPECT_NEAR(evaluate(a).cost, evaluate(b).cost, std::sqrt(near) * evaluate(b).cost);
  }
}

TEST(Solver, CovariancesKnowNothingOfWhatIsSwitchedOff) {
  auto [with_all, without] = switched_off_and_gone();
  // Points that tie nothing to nothing are not at issue here.
  for (Problem* p : {&with_all, &without}) p->terms.kept_points = {1, 5};
  CovarianceOptions options;
  options.gauge = Gauge::free_centres;
  const Covariance a = covariance(with_all, options).value();
  const Covariance b = covariance(without, options).value();
  EXPECT_EQ(a.rows, b.rows);
  EXPECT_NEAR(a.sigma, b.sigma, 1e-9 * b.sigma);
  for (std::size_t i = 0; i < b.poses.size(); ++i)
    for (std::size_t k = 0; k < 36; ++k)
      EXPECT_NEAR(a.poses[i][k], b.poses[i][k], 1e-9 * std::sqrt(b.poses[i][0] * b.poses[i][0]));
}

TEST(Solver, GoesOnWhereAnAttemptWentWrong) {
  Problem bad = small_scene().start;
  disturb(bad, {.rotation_rad = 0.3, .center = 0.5, .point = 0.5, .focal = 0.2, .seed = 5});
  Solver solver(few(40));
  Problem found = small_scene().start;
  solver.solve(found);
  for (int round = 0; round < 2; ++round) {
    Problem expected = bad;
    found = bad;
    const Summary by_solve = solve(expected, few(40));
    EXPECT_FALSE(by_solve.recoveries.empty());
    expect_equal(solver.solve(found), by_solve);
    expect_equal(found, expected);
  }
}

}  // namespace
}  // namespace sheaf
