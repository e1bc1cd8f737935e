// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Runs that are stopped at any step, written down and gone on with by another solve: the state, the
// costs and the words of the run that was never stopped, bit for bit.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "sheaf/sheaf.h"
#include "solve/lens_problems.h"
#include "solve/rig_problems.h"

namespace sheaf {
namespace {

class Checkpoints : public testing::Test {
 protected:
  ~Checkpoints() override { std::filesystem::remove_all(folder_); }
  std::string path() const {
    std::filesystem::create_directories(folder_);
    return folder_ / "checkpoint";
  }
  std::string bytes() const {
    std::ifstream file(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void put(const std::string& bytes) const {
    std::ofstream(path(), std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
  }

  /// Stopped after step `at` of the uninterrupted run; false where that has ended by then.
  bool stop_after(const Problem& start, SolveOptions options, int at) {
    Problem p = start;
    std::filesystem::remove(path());
    options.checkpoint = path();
    options.checkpoint_every_s = 0;
    options.on_iteration = [at](const Iteration& it) { return it.index < at; };
    return solve(p, options).termination == Termination::stopped && std::filesystem::exists(path());
  }
  /// Goes on from there with so many threads.
  Summary resume(const Problem& start, SolveOptions options, int threads, Problem& end) {
    end = start;
    options.resume = path();
    options.threads = threads;
    return solve(end, options);
  }

  void expect_same_ends(const Problem& start, SolveOptions options, const char* what = "") {
    SCOPED_TRACE(what);
    options.threads = 2;
    Problem whole = start;
    const Summary expected = solve(whole, options);
    int stopped = 0;
    for (int at = 1; at < static_cast<int>(expected.iterations.size()); at += 1 + at / 2) {
      if (!stop_after(start, options, at)) continue;
      ++stopped;
      SCOPED_TRACE(at);
      Problem parts;
      const Summary got = resume(start, options, 1 + at % 2, parts);
      EXPECT_LT(got.resumed_after, at);
      expect_same(whole, parts);
      expect_same(expected, got);
    }
    EXPECT_GT(stopped, 0);
  }

 private:
  static bool same(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), 8 * a.size()) == 0;
  }
  static void expect_same(const Problem& a, const Problem& b) {
    EXPECT_TRUE(same(a.points, b.points));
    for (std::size_t i = 0; i < a.num_images(); ++i) {
      EXPECT_EQ(a.poses[i].rotation, b.poses[i].rotation) << i;
      EXPECT_EQ(a.poses[i].translation, b.poses[i].translation) << i;
    }
    for (std::size_t c = 0; c < a.cameras.size(); ++c)
      EXPECT_EQ(a.cameras[c].parameters, b.cameras[c].parameters) << c;
    EXPECT_EQ(a.observation_xy, b.observation_xy);
  }
  static void expect_same(const Summary& a, const Summary& b) {
    ASSERT_EQ(a.iterations.size(), b.iterations.size());
    for (std::size_t k = 0; k < a.iterations.size(); ++k) {
      EXPECT_EQ(a.iterations[k].cost, b.iterations[k].cost) << k;
      EXPECT_EQ(a.iterations[k].damping, b.iterations[k].damping) << k;
      EXPECT_EQ(a.iterations[k].linear_iterations, b.iterations[k].linear_iterations) << k;
      EXPECT_EQ(a.iterations[k].round, b.iterations[k].round) << k;
    }
    EXPECT_EQ(a.termination, b.termination);
    EXPECT_EQ(a.words, b.words);
    EXPECT_EQ(a.solver, b.solver);
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.initial_cost, b.initial_cost);
    EXPECT_EQ(a.final_cost, b.final_cost);
    EXPECT_EQ(a.initial_rms_px, b.initial_rms_px);
    EXPECT_EQ(a.final_sigma_px, b.final_sigma_px);
    EXPECT_EQ(a.rejected_observations, b.rejected_observations);
    EXPECT_EQ(a.behind_camera_before, b.behind_camera_before);
    EXPECT_EQ(a.behind_camera_after, b.behind_camera_after);
    EXPECT_EQ(a.recoveries.size(), b.recoveries.size());
    ASSERT_EQ(a.rounds.size(), b.rounds.size());
    for (std::size_t k = 0; k < a.rounds.size(); ++k) {
      EXPECT_EQ(a.rounds[k].scale_px, b.rounds[k].scale_px) << k;
      EXPECT_EQ(a.rounds[k].steps, b.rounds[k].steps) << k;
      EXPECT_EQ(a.rounds[k].initial_cost, b.rounds[k].initial_cost) << k;
      EXPECT_EQ(a.rounds[k].final_cost, b.rounds[k].final_cost) << k;
    }
  }

  const std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("sheaf-checkpoints-" + std::to_string(::getpid()));
};

Problem lakeside(int images = 70) {
  SceneOptions options;
  options.images = images;
  options.points = 900;
  return generate(options).value().start;
}
Problem street() {
  FamilyOptions options;
  options.family = SceneFamily::street;
  options.images = 80;
  options.points = 1500;
  options.observations = 7000;
  return generate(options).value().start;
}

TEST_F(Checkpoints, EverySolverEndsAsIfNothingHadHappened) {
  const Problem problem = lakeside();
  for (const CameraSolverKind solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit})
    for (const Precision precision : {Precision::full, Precision::mixed}) {
      SCOPED_TRACE(testing::Message() << int(solver) << " " << int(precision));
      SolveOptions options;
      options.solver = solver;
      options.precision = precision;
      options.tolerance = 1e-12;
      if (precision == Precision::mixed &&
          (solver == CameraSolverKind::dense || solver == CameraSolverKind::sparse))
        continue;
      expect_same_ends(problem, options);
    }
}

TEST_F(Checkpoints, SoDoStreetsWhosePointsHaveAnotherChart) {
  for (const CameraSolverKind solver :
       {CameraSolverKind::automatic, CameraSolverKind::iterative_implicit}) {
    SolveOptions options;
    options.solver = solver;
    options.cheirality = Cheirality::hold_out;
    expect_same_ends(street(), options);
    // Floats find no positive definite matrix on the way, and what was recycled is forgotten.
    options.loss = {LossKind::huber, kAutomaticScale};
    options.tolerance = 1e-12;
    options.max_iterations = 20;
    expect_same_ends(street(), options);
  }
}

TEST_F(Checkpoints, SoDoLossesWhoseScaleMoves) {
  Problem problem = lakeside(30);
  for (std::size_t i = 0; i < problem.num_observations(); i += 11)
    problem.observation_xy[2 * i] += 25;
  SolveOptions options;
  options.loss = {LossKind::huber, kAutomaticScale};
  expect_same_ends(problem, options);
  options.loss = {LossKind::cauchy, 1.0};
  expect_same_ends(problem, options);
  options.loss = {LossKind::tukey, kAutomaticScale, true};
  expect_same_ends(problem, options);
}

TEST_F(Checkpoints, SoDoDoglegsLensesRigsTermsAndHeldPoints) {
  SolveOptions options;
  options.tolerance = 1e-12;
  const Problem lenses = test::disturbed({test::ordinary(CameraModel::opencv)}, 8, 90, 4);
  expect_same_ends(lenses, options, "lenses");
  Problem rigs = test::rig_problem({.frames = 5, .points = 60, .model = CameraModel::radial});
  expect_same_ends(rigs, options, "rigs");
  rigs.terms.distances.push_back({7, 9, 1.3, 0.01, {}});
  for (std::size_t i = 0; i < rigs.num_observations(); ++i)
    rigs.observation_sigma.push_back(0.5 + 0.25 * static_cast<double>(i % 7));
  expect_same_ends(rigs, options, "rigs, terms, sigmas");
  SolveOptions dogleg = options, held = options;
  dogleg.trust_region = TrustRegion::dogleg;
  dogleg.initial_damping = 1e-8;
  dogleg.points = PointParametrisation::xyz;
  expect_same_ends(lakeside(20), dogleg, "dogleg");
  held.fixed.points = true;
  expect_same_ends(lakeside(20), held, "points held");
}

/// From a start so bad that images are resected and points intersected.
TEST_F(Checkpoints, SoDoRunsThatRecover) {
  Problem problem = lakeside(12);
  NoiseOptions noise;
  noise.rotation_rad = 0.4;
  perturb(problem, noise).value();
  SolveOptions options;
  options.max_iterations = 60;
  Problem whole = problem;
  ASSERT_FALSE(solve(whole, options).recoveries.empty());
  expect_same_ends(problem, options);
}

TEST_F(Checkpoints, OtherProblemsAndOptionsAreRefusedByName) {
  const Problem problem = lakeside(12);
  const SolveOptions options;
  ASSERT_TRUE(stop_after(problem, options, 2));
  const auto words = [&](const Problem& p, SolveOptions o) {
    Problem copy = p;
    o.resume = path();
    const Result<Summary> s = try_solve(copy, o);
    return s.ok() ? std::string("resumed") : std::string(s.error().what());
  };
  EXPECT_EQ(words(problem, options), "resumed");
  Problem moved = problem, scaled = problem;
  moved.points[4] += 1e-9;
  EXPECT_NE(words(moved, options).find("of another problem"), std::string::npos);
  scaled.terms.distances.push_back({0, 1, 1.3, 0.01, {}});
  EXPECT_NE(words(scaled, options).find("of another problem"), std::string::npos);
  SolveOptions loose = options, robust = options, held = options, few = options;
  loose.tolerance = 1e-3;
  robust.loss = {LossKind::huber, 1.5};
  held.fixed.f = true;
  few.inner_iterations = 1;
  EXPECT_NE(words(problem, loose).find("--tolerance 1e-08, this one has 0.001"), std::string::npos)
      << words(problem, loose);
  EXPECT_NE(words(problem, robust).find("--loss none, this one has huber:1.5"), std::string::npos);
  EXPECT_NE(words(problem, held).find("held parameters"), std::string::npos);
  EXPECT_NE(words(problem, few).find("--inner-iterations 3"), std::string::npos);
  SolveOptions scalar = options;
  scalar.simd = Simd::scalar;
  EXPECT_NE(words(problem, scalar).find("--simd"), std::string::npos);
}

/// Cut off anywhere, or with any byte another: a sentence, and never a state.
TEST_F(Checkpoints, DamageIsFound) {
  const Problem problem = lakeside(6);
  ASSERT_TRUE(stop_after(problem, {}, 2));
  const std::string whole = bytes();
  SolveOptions options;
  options.resume = path();
  const auto code = [&](const std::string& damaged) {
    put(damaged);
    Problem p = problem;
    const Result<Summary> s = try_solve(p, options);
    EXPECT_EQ(p.points, s.ok() ? p.points : problem.points);
    return s.ok() ? 0 : static_cast<int>(s.error().code());
  };
  EXPECT_EQ(code(whole), 0);
  for (std::size_t k = 0; k < 200; ++k) {
    std::string damaged = whole;
    const std::size_t at = k * 7919 % whole.size();
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << k % 8));
    EXPECT_EQ(code(damaged), 3) << at;
    EXPECT_EQ(code(whole.substr(0, at)), 3) << at;
  }
  EXPECT_EQ(code(whole + "x"), 3);
  std::filesystem::remove(path());
  Problem p = problem;
  EXPECT_EQ(try_solve(p, options).error().code(), ErrorCode::unreadable_input);
}

TEST_F(Checkpoints, ASolveOutlivesOneThatCannotBeWritten) {
  Problem problem = lakeside(6);
  SolveOptions options;
  options.checkpoint = "/nowhere/at/all";
  options.checkpoint_every_s = 0;
  const Summary summary = solve(problem, options);
  EXPECT_TRUE(summary.usable());
  EXPECT_EQ(summary.checkpoints, 0);
  EXPECT_NE(summary.checkpoint_failure.find("/nowhere/at/all"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
