// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/terms.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "geometry/motion_log.h"
#include "sheaf/solve.h"
#include "solve/rig_problems.h"
#include "solve/wide_textbook.h"

namespace sheaf {
namespace {

using test::rig_problem;
using test::RigScene;
using Block = GaussianPrior::Block;

const std::vector<CameraSolverKind> kSolvers{CameraSolverKind::dense, CameraSolverKind::sparse,
                                             CameraSolverKind::iterative_explicit,
                                             CameraSolverKind::iterative_implicit};

std::array<double, 3> centre_of(const Pose& pose) {
  const auto R = matrix_from_quaternion(pose.rotation);
  std::array<double, 3> C{};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 3; ++i) C[k] -= R[3 * i + k] * pose.translation[i];
  return C;
}

Covariance3 covariance(double scale) {
  return {4 * scale, scale, 0, scale, 2 * scale, 0.5 * scale, 0, 0.5 * scale, 3 * scale};
}

void add_centres(Problem& p, TermLoss loss) {
  for (const std::uint32_t i : {0u, 3u, 5u}) {
    auto C = centre_of(p.poses[i]);
    for (std::size_t k = 0; k < 3; ++k) C[k] += 0.03 * (k + 1.0) - 0.02 * i;
    p.terms.centres.push_back({i, C, covariance(1e-4), loss});
  }
}
/// Positions with lever arms, rotations, gravity, a motion, a focal length and a distortion.
void add_poses(Problem& p, TermLoss loss) {
  add_centres(p, loss);
  p.terms.centres[1].lever_arm = {0.3, -0.2, 0.1};
  const auto turned = [](const Pose& pose, double by) {
    return left_perturbed<double>({pose.rotation, pose.translation}, {by, -by, by / 2},
                                  {0.7 * by, by, -0.4 * by});
  };
  p.terms.rotations.push_back({2, turned(p.poses[2], 0.01).rotation, covariance(1e-6), loss});
  const auto R = matrix_from_quaternion(turned(p.poses[1], 0.02).rotation);
  p.terms.gravities.push_back({1, {R[1], R[4], R[7]}, {0, 1, 0}, 2e-3, loss});
  RelativePosePrior motion;
  motion.first = 0, motion.second = 4, motion.loss = loss;
  const auto b_from_a = composed(turned(p.poses[4], 0.01),
                                 inverse<double>({p.poses[0].rotation, p.poses[0].translation}));
  motion.rotation = b_from_a.rotation, motion.translation = b_from_a.translation;
  for (std::size_t k = 0; k < 6; ++k)
    for (std::size_t i = 0; i <= k; ++i)
      motion.square_root[6 * k + i] = i == k ? 300 : 20.0 - 9 * i;
  p.terms.relative_poses.push_back(motion);
}
void add_parameters(Problem& p, TermLoss loss) {
  p.terms.parameters.push_back({0, 0, p.cameras[0].parameters[0] + 2, 0.5, loss});
  p.terms.parameters.push_back({0, 4, p.cameras[0].parameters[4] + 1e-3, 1e-4, loss});
}
void add_points(Problem& p) {
  for (const std::uint32_t j : {2u, 7u, 8u, 21u})
    p.terms.points.push_back(
        {j,
         {p.points[3 * j] + 0.01, p.points[3 * j + 1] - 0.02, p.points[3 * j + 2] + 0.015},
         covariance(1e-5)});
}
double distance_of(const Problem& p, std::uint32_t a, std::uint32_t b) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += std::pow(p.points[3 * a + k] - p.points[3 * b + k], 2);
  return std::sqrt(sum);
}
/// The scene 3 % larger than it is.
void add_distances(Problem& p, TermLoss loss) {
  p.terms.distances.push_back({1, 2, 1.03 * distance_of(p, 1, 2), 0.01, loss});
  p.terms.distances.push_back({2, 9, 1.03 * distance_of(p, 2, 9), 0.02, loss});
  p.terms.kept_points.push_back(12);
}
Block pose_block(const Problem& p, std::uint32_t i) {
  const Pose& pose = p.poses[i];
  std::vector<double> state(pose.rotation.begin(), pose.rotation.end());
  state.insert(state.end(), pose.translation.begin(), pose.translation.end());
  state[4] += 0.02, state[6] -= 0.05;
  return {Block::Kind::pose, i, state};
}
void add_gaussian(Problem& p, TermLoss loss) {
  GaussianPrior prior;
  prior.loss = loss;
  prior.blocks = {pose_block(p, 1), pose_block(p, 4)};
  const Camera& camera = p.cameras[0];
  std::vector<double> state(
      camera.parameters.begin(),
      camera.parameters.begin() + static_cast<std::ptrdiff_t>(parameter_count(camera.model)));
  state[0] += 3;
  prior.blocks.push_back({Block::Kind::camera, 0, state});
  prior.blocks.push_back(
      {Block::Kind::point, 5, {p.points[15] + 0.01, p.points[16], p.points[17]}});
  const std::size_t columns = 15 + state.size(), rows = columns - 2;
  Random random(4);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t k = 0; k < columns; ++k) {
      const bool lens = k >= 12 && k < 12 + state.size();
      prior.square_root.push_back((r == k ? 40 : 0) + 5 * random.normal() * (lens ? 1e-2 : 1));
    }
  prior.mean.assign(columns, 1e-3);
  p.terms.gaussians.push_back(prior);
}
void add_sigmas(Problem& p) {
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    p.observation_sigma.push_back(0.5 + 0.25 * static_cast<double>(i % 7));
}

struct Variant {
  std::string name;
  Problem start;
  Fixed fixed{};
  Loss loss{};
};

std::vector<Variant> variants() {
  const auto scene = [](CameraModel of) {
    return rig_problem({.frames = 4, .points = 40, .model = of});
  };
  const auto unrigged = [&](CameraModel of) {
    Problem p = scene(of);
    p.rigs = {};
    return p;
  };
  std::vector<Variant> out;
  const auto with = [&](const char* name, Problem p, const auto& add, Fixed fixed = {},
                        Loss loss = {}) {
    add(p);
    out.push_back({name, std::move(p), std::move(fixed), loss});
  };
  const auto everything = [](Problem& p) {
    add_poses(p, {}), add_parameters(p, {});
    add_points(p), add_distances(p, {}), add_gaussian(p, {}), add_sigmas(p);
  };
  const auto robust = [](Problem& p) {
    add_poses(p, {LossKind::cauchy, 2}), add_distances(p, {LossKind::huber, 1});
    add_points(p), add_gaussian(p, {LossKind::soft_l1, 3}), add_sigmas(p);
  };
  Fixed points, poses;
  points.points = true, poses.poses = true;
  const CameraModel radial = CameraModel::radial, opencv = CameraModel::opencv;
  with("Centres", unrigged(radial), [](Problem& p) { add_centres(p, {}); });
  with("Poses", unrigged(radial), [](Problem& p) { add_poses(p, {}); });
  with("PosesOfLenses", unrigged(opencv), [](Problem& p) { add_poses(p, {}); });
  with("PosesOnRadialRigs", scene(radial), [](Problem& p) { add_poses(p, {}); });
  with("Parameters", unrigged(opencv), [](Problem& p) { add_parameters(p, {}); });
  with("Points", unrigged(radial), [](Problem& p) { add_points(p); });
  with("PointsOfLenses", unrigged(opencv), [](Problem& p) { add_points(p); });
  with("Distances", unrigged(radial), [](Problem& p) { add_distances(p, {}); });
  with("DistancesOfLenses", unrigged(opencv), [](Problem& p) { add_distances(p, {}); });
  with("Gaussian", unrigged(radial), [](Problem& p) { add_gaussian(p, {}); });
  with("GaussianOfLenses", unrigged(opencv), [](Problem& p) { add_gaussian(p, {}); });
  with("Sigmas", unrigged(radial), add_sigmas);
  with("SigmasOfLenses", unrigged(opencv), add_sigmas);
  with("SigmasAndLoss", unrigged(opencv), add_sigmas, {}, Huber{0.7});
  with("Everything", unrigged(opencv), everything);
  with("EverythingRadial", unrigged(radial), everything);
  with("EverythingOnRigs", scene(opencv), everything);
  with("EverythingOnRadialRigs", scene(radial), everything);
  with("LossesOnRigs", scene(opencv), robust, {}, Cauchy{1.0});
  with("PointsHeld", scene(radial), everything, points);
  with("PosesHeld", unrigged(opencv), everything, poses);
  return out;
}
constexpr int kVariants = 21;

class TermSteps : public testing::TestWithParam<int> {
 protected:
  const Variant variant_ = variants()[static_cast<std::size_t>(GetParam())];
};

TEST_P(TermSteps, AreTheTextbooks) {
  for (const auto solver : {CameraSolverKind::dense, CameraSolverKind::sparse})
    expect_wide_step(variant_.start, variant_.fixed, solver, variant_.loss);
}

TEST_P(TermSteps, EndAlikeByEverySolver) {
  double first = 0;
  for (const auto solver : kSolvers)
    for (const auto precision : {Precision::full, Precision::mixed})
      for (const auto region : {TrustRegion::lm, TrustRegion::dogleg}) {
        Problem p = variant_.start;
        SolveOptions options;
        options.fixed = variant_.fixed;
        options.loss = variant_.loss;
        options.solver = solver;
        options.precision = precision;
        options.trust_region = region;
        options.tolerance = 1e-13;
        options.max_iterations = 150;
        const Summary summary = solve(p, options);
        if (first == 0) first = summary.final_cost;
        EXPECT_NEAR(summary.final_cost, first, 1e-9 * first) << summary.solver;
        if (variant_.loss.kind == LossKind::none) {
          EXPECT_NEAR(evaluate(p).cost, summary.final_plain_cost, 1e-9 * first);
          EXPECT_NEAR(evaluate(p).cost + cost_of_terms(p) / 2, summary.final_cost, 1e-9 * first);
          EXPECT_NEAR(summary.final_terms.total(), cost_of_terms(p) / 2, 1e-9 * first);
        }
        EXPECT_LT(summary.final_cost, summary.initial_cost);
      }
}

TEST_P(TermSteps, AreTheSameBitsOnAnyThreads) {
  for (const auto solver : {CameraSolverKind::sparse, CameraSolverKind::iterative_implicit}) {
    std::uint64_t first = 0;
    for (const int threads : {1, 2, 5}) {
      Problem p = variant_.start;
      SolveOptions options;
      options.fixed = variant_.fixed;
      options.loss = variant_.loss;
      options.solver = solver;
      options.threads = threads;
      solve(p, options);
      if (threads == 1) first = state_hash(p);
      EXPECT_EQ(state_hash(p), first);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Variants, TermSteps, testing::Range(0, kVariants),
                         [](const auto& info) { return variants()[info.param].name; });

TEST(TermSteps, StrongPriorsAreMet) {
  Problem p = rig_problem({.frames = 6, .points = 150, .model = CameraModel::opencv});
  p.rigs = {};
  add_distances(p, {});
  p.terms.distances[0].sigma = p.terms.distances[1].sigma = 1e-7;
  solve(p, {.max_iterations = 100});
  for (const DistancePrior& of : p.terms.distances)
    EXPECT_NEAR(distance_of(p, of.first, of.second), of.distance, 1e-6);
}

}  // namespace
}  // namespace sheaf
