// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "lists/block_map.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "solve/rig_problems.h"
#include "solve/wide_textbook.h"

namespace sheaf {
namespace {

using test::rig_problem;
using test::RigScene;

struct Variant {
  const char* name;
  RigScene scene;
  Fixed fixed{};
};

std::vector<Variant> variants() {
  Fixed sensors, poses, points, one;
  sensors.sensors = true;
  poses.poses = true;
  points.points = true;
  one.pose_ids = {0}, one.frame_ids = {2}, one.sensor_ids = {1};
  const auto model = [](CameraModel of) {
    return RigScene{.frames = 4, .points = 40, .model = of};
  };
  RigScene shared = model(CameraModel::opencv), bal = model(CameraModel::radial);
  shared.shared_lens = true;
  RigScene imu{.frames = 6, .points = 80}, mixed = model(CameraModel::radial);
  imu.camera_reference = false;
  mixed.free_images = 3;
  RigScene three = model(CameraModel::opencv_fisheye);
  three.sensors = 3;
  return {{"Opencv", model(CameraModel::opencv)},
          {"SharedLens", shared},
          {"Radial", bal},
          {"NoReferenceCamera", imu},
          {"FreeImages", mixed},
          {"ThreeFisheyes", three},
          {"SensorsHeld", model(CameraModel::radial), sensors},
          {"PosesHeld", model(CameraModel::opencv), poses},
          {"PointsHeld", model(CameraModel::radial), points},
          {"PointsHeldLenses", model(CameraModel::opencv), points},
          {"SomeHeld", model(CameraModel::opencv), one}};
}

class RigSteps : public testing::TestWithParam<int> {
 protected:
  const Variant variant_ = variants()[static_cast<std::size_t>(GetParam())];
};

TEST_P(RigSteps, AreTheTextbooks) {
  const Problem start = rig_problem(variant_.scene);
  for (const auto solver : {CameraSolverKind::dense, CameraSolverKind::sparse})
    expect_wide_step(start, variant_.fixed, solver);
}

TEST_P(RigSteps, EndAlikeByEverySolver) {
  const Problem start = rig_problem(variant_.scene);
  double first = 0;
  for (const auto solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit})
    for (const auto precision : {Precision::full, Precision::mixed})
      for (const auto region : {TrustRegion::lm, TrustRegion::dogleg}) {
        Problem p = start;
        SolveOptions options;
        options.fixed = variant_.fixed;
        options.solver = solver;
        options.precision = precision;
        options.trust_region = region;
        options.tolerance = 1e-13;
        options.max_iterations = 100;
        const Summary summary = solve(p, options);
        if (first == 0) first = summary.final_cost;
        EXPECT_NEAR(summary.final_cost, first, 1e-9 * first) << summary.solver;
        EXPECT_NEAR(evaluate(p).cost, summary.final_cost, 1e-9 * first);
        EXPECT_LT(summary.final_cost, summary.initial_cost);
        expect_rigid(p);
        const MovingPoses moving = moving_poses(start, variant_.fixed);
        for (std::size_t f = 0; f < start.rigs.num_frames(); ++f)
          EXPECT_EQ(
              start.rigs.rig_from_world[f].translation == p.rigs.rig_from_world[f].translation,
              moving.frames[f] == 0);
        for (std::size_t s = 0; s < start.rigs.num_sensors(); ++s)
          EXPECT_EQ(start.rigs.sensor_from_rig[s].rotation == p.rigs.sensor_from_rig[s].rotation,
                    moving.sensors[s] == 0);
      }
}

TEST_P(RigSteps, AreTheSameBitsOnAnyThreads) {
  const Problem start = rig_problem(variant_.scene);
  for (const auto solver : {CameraSolverKind::sparse, CameraSolverKind::iterative_implicit}) {
    Problem first;
    for (const int threads : {1, 2, 5}) {
      Problem p = start;
      SolveOptions options;
      options.fixed = variant_.fixed;
      options.solver = solver;
      options.threads = threads;
      solve(p, options);
      if (threads == 1) first = p;
      EXPECT_EQ(state_hash(p), state_hash(first));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Variants, RigSteps, testing::Range(0, 11),
                         [](const auto& info) { return std::string(variants()[info.param].name); });

/// Frames enough for a coarse space, whose clusters move kept points, too, and feel what terms
/// couple.
TEST(LongDrive, EndsAlikeByEverySolver) {
  RigSceneOptions street;
  street.frames = 70;
  street.single_images = 4;
  street.scene.points = 700;
  street.sensor_rotation_noise_rad = 0.002;
  const Scene scene = generate(street).value();
  Problem start = scene.start;
  for (std::uint32_t i = 0; i < start.num_images(); i += 9) {
    const Pose pose = pose_of(scene.truth, i);
    const auto R = matrix_from_quaternion(pose.rotation);
    CentrePrior prior;
    prior.image = i;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t r = 0; r < 3; ++r) prior.position[k] -= R[3 * r + k] * pose.translation[r];
    prior.covariance = {1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4};
    start.terms.centres.push_back(prior);
  }
  for (std::uint32_t j = 0; j + 40 < start.num_points(); j += 100) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k)
      square += std::pow(scene.truth.points[3 * j + k] - scene.truth.points[3 * (j + 40) + k], 2);
    start.terms.distances.push_back({j, j + 40, std::sqrt(square), 0.01, {}});
  }
  double first = 0;
  for (const auto solver : {CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
                            CameraSolverKind::iterative_implicit})
    for (const auto precision : {Precision::full, Precision::mixed}) {
      if (solver == CameraSolverKind::sparse && precision == Precision::mixed) continue;
      Problem p = start;
      SolveOptions options;
      options.solver = solver;
      options.precision = precision;
      options.tolerance = 1e-12;
      const Summary summary = solve(p, options);
      if (first == 0) first = summary.final_cost;
      EXPECT_NEAR(summary.final_cost, first, 1e-8 * first) << summary.solver;
      EXPECT_LT(summary.iterations.size(), 30u) << summary.solver;
      int most = 0;
      for (const Iteration& it : summary.iterations) most = std::max(most, it.linear_iterations);
      EXPECT_LT(most, 120) << summary.solver;
      expect_rigid(p);
    }
}

}  // namespace
}  // namespace sheaf
