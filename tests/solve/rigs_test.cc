// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "lists/block_map.h"
#include "sheaf/solve.h"
#include "solve/rig_problems.h"
#include "solve/textbook.h"
#include "systems/block_fold.h"

namespace sheaf {
namespace {

using test::rig_problem;
using test::RigScene;

void expect_rigid(const Problem& p) {
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    const Pose pose = pose_of(p, i);
    EXPECT_EQ(pose.rotation, p.poses[i].rotation) << i;
    EXPECT_EQ(pose.translation, p.poses[i].translation) << i;
  }
}

/// Columns of the textbook's images, frames and sensors: x_images = M x.
struct RigPlaces {
  std::vector<std::vector<std::pair<int, double>>> rows;  ///< of each column of the images' places
  int count = 0;

  RigPlaces(const Problem& p, const Fixed& fixed, const Places& images) : rows(images.count) {
    const MovingPoses moving = moving_poses(p, fixed);
    const auto number = [&](const std::vector<std::uint8_t>& moves) {
      std::vector<int> first;
      for (const std::uint8_t m : moves) {
        first.push_back(m != 0 ? count : -1);
        count += m != 0 ? 6 : 0;
      }
      return first;
    };
    frames = number(moving.frames), sensors = number(moving.sensors);
    CameraState state = camera_state(p);
    const Adjoints adjoints = adjoints_of(state);
    for (std::size_t i = 0; i < p.num_images(); ++i)
      for (int k = 0; k < 6; ++k) {
        auto& row = rows[images.pose[6 * i + k]];
        if (!in_rig(p.rigs, i)) {
          row.emplace_back(count++, 1.0);
          continue;
        }
        const std::uint32_t f = p.rigs.image_frame[i], s = p.rigs.image_sensor[i];
        for (int c = 0; c < 6 && frames[f] >= 0; ++c)
          row.emplace_back(frames[f] + c, adjoints[s][6 * k + c]);
        if (sensors[s] >= 0) row.emplace_back(sensors[s] + k, 1.0);
      }
    for (const auto* places : {&images.lens, &images.point})
      for (const int column : *places)
        if (column >= 0) rows[column].emplace_back(count++, 1.0);
  }
  std::vector<int> frames, sensors;
};

/// One step against the textbook's: normal equations of free images, M^T A M, D = sum M^2 diag(A).
void expect_rig_step(const Problem& start, const Fixed& fixed, CameraSolverKind solver) {
  const double lambda = 1e-4;
  Fixed beside_poses;
  beside_poses.points = fixed.points;
  const Places places(start, beside_poses);
  const Charts charts(start);
  const Normal normal(start, places, {}, charts);
  const RigPlaces M(start, fixed, places);
  const auto n = static_cast<std::size_t>(M.count);
  std::vector<double> A(n * n), b(n);
  for (std::size_t r = 0; r < M.rows.size(); ++r)
    for (const auto& [i, mi] : M.rows[r]) {
      b[i] += mi * normal.b[r];
      A[i * n + i] += lambda * mi * mi * normal.A[r * M.rows.size() + r];
      for (std::size_t c = 0; c < M.rows.size(); ++c)
        for (const auto& [k, mk] : M.rows[c])
          A[i * n + k] += mi * mk * normal.A[r * M.rows.size() + c];
    }
  const std::vector<double> x = solve_dense(A, b);
  Problem moved = start;
  const auto step = [&](Pose& pose, int at) {
    if (at < 0) return;
    const auto to =
        left_perturbed<double>({pose.rotation, pose.translation}, {x[at], x[at + 1], x[at + 2]},
                               {x[at + 3], x[at + 4], x[at + 5]});
    pose = {to.rotation, to.translation};
  };
  std::vector<double> by_image(M.rows.size());
  for (std::size_t r = 0; r < M.rows.size(); ++r)
    for (const auto& [i, mi] : M.rows[r]) by_image[r] += mi * x[i];
  move(moved, places, by_image, charts);
  for (std::size_t f = 0; f < M.frames.size(); ++f) step(moved.rigs.rig_from_world[f], M.frames[f]);
  for (std::size_t s = 0; s < M.sensors.size(); ++s)
    step(moved.rigs.sensor_from_rig[s], M.sensors[s]);

  Problem p = start;
  SolveOptions options;
  options.max_iterations = 1;
  options.initial_damping = lambda;
  options.inner_iterations = 0;
  options.fixed = fixed;
  options.solver = solver;
  const Summary summary = solve(p, options);
  ASSERT_EQ(summary.iterations.size(), 2u);
  const double expected = evaluate(moved).cost;
  EXPECT_NEAR(summary.iterations[1].trial_cost, expected, 1e-9 * expected) << summary.solver;
  EXPECT_NEAR(summary.initial_cost, evaluate(start).cost, 1e-9 * summary.initial_cost);
  expect_rigid(p);
}

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
  RigScene imu = model(CameraModel::opencv), mixed = model(CameraModel::radial);
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
    expect_rig_step(start, variant_.fixed, solver);
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

}  // namespace
}  // namespace sheaf
