// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/similarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

const Similarity kMove{2.5, normalized(Quaternion<double>{0.3, -0.5, 0.7, 0.2}),
                       Vector3<double>{40, -7, 12}};

Problem drive() {
  RigSceneOptions options;
  options.frames = 12;
  options.single_images = 3;
  options.scene.points = 200;
  return generate(options).value().start;
}

/// A prior of every kind that a program can state, none of them met.
void state_terms(Problem& p) {
  const Covariance3 C{0.04, 0.01, 0, 0.01, 0.09, -0.02, 0, -0.02, 0.16};
  p.terms.centres.push_back(
      {.image = 1, .position = {1, 2, 3}, .covariance = C, .loss = {LossKind::cauchy, 2}});
  p.terms.points.push_back({.point = 5, .position = {3, 1, -2}, .covariance = C});
  p.terms.distances.push_back({.first = 3, .second = 9, .distance = 4, .sigma = 0.5});
  GaussianPrior gaussian;
  using Kind = GaussianPrior::Block::Kind;
  const Pose& pose = p.poses[4];
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  gaussian.blocks = {{Kind::point, 7, {1, -1, 2}},
                     {Kind::pose, 4, {q[0], q[1], q[2], q[3], t[0] + 0.3, t[1] - 0.2, t[2] + 0.1}}};
  for (int i = 0; i < 2 * 9; ++i) gaussian.square_root.push_back(std::sin(i + 1.0));
  gaussian.mean = {0.1, 0.2, -0.3, 0.04, -0.05, 0.06, 0.01, 0.02, 0.03};
  p.terms.gaussians.push_back(gaussian);
}

TEST(Similarity, MovesAProblemWithoutChangingWhatItCosts) {
  Problem before = drive();
  state_terms(before);
  Problem after = before;
  move(after, kMove);
  ASSERT_TRUE(validate(after).ok());
  const double cost = evaluate(before).cost;
  EXPECT_NEAR(evaluate(after).cost, cost, 1e-9 * cost);
  const TermCosts a = evaluate_terms(before), b = evaluate_terms(after);
  EXPECT_GT(a.gaussians, 0);
  EXPECT_NEAR(b.centres, a.centres, 1e-9 * a.centres);
  EXPECT_NEAR(b.points, a.points, 1e-9 * a.points);
  EXPECT_NEAR(b.distances, a.distances, 1e-9 * a.distances);
  EXPECT_NEAR(b.gaussians, a.gaussians, 1e-9 * a.gaussians);
}

TEST(Similarity, MovesPointsFramesAndSensors) {
  const Problem before = drive();
  Problem after = before;
  move(after, kMove);
  for (std::size_t i = 0; i < before.num_points(); ++i) {
    const Vector3<double> X =
        kMove({before.points[3 * i], before.points[3 * i + 1], before.points[3 * i + 2]});
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(after.points[3 * i + k], X[k]);
  }
  ASSERT_GT(before.rigs.num_sensors(), 1u);
  for (std::size_t s = 0; s < before.rigs.num_sensors(); ++s) {
    EXPECT_EQ(after.rigs.sensor_from_rig[s].rotation, before.rigs.sensor_from_rig[s].rotation);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(after.rigs.sensor_from_rig[s].translation[k],
                2.5 * before.rigs.sensor_from_rig[s].translation[k]);
  }
  for (std::size_t j = 0; j < after.num_images(); ++j)
    EXPECT_EQ(after.poses[j].translation, pose_of(after, j).translation);
}

TEST(Similarity, ItsInverseLeadsBack) {
  const Problem before = drive();
  Problem after = before;
  move(after, kMove);
  move(after, inverse(kMove));
  for (std::size_t i = 0; i < before.points.size(); ++i)
    EXPECT_NEAR(after.points[i], before.points[i], 1e-11);
  for (std::size_t j = 0; j < before.num_images(); ++j)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(pose_of(after, j).translation[k], pose_of(before, j).translation[k], 1e-11);
}

TEST(Similarity, KeepsRotationsThatItDoesNotTurn) {
  SceneOptions options;
  options.images = 5;
  options.points = 50;
  const Problem before = generate(options).value().start;
  Problem after = before;
  move(after, {3, {1, 0, 0, 0}, {1, 2, 3}});
  for (std::size_t j = 0; j < before.num_images(); ++j)
    EXPECT_EQ(after.poses[j].rotation, before.poses[j].rotation);
  EXPECT_NE(after.points, before.points);
  after = before;
  move(after, {});
  EXPECT_EQ(state_hash(after), state_hash(before));
}

TEST(Similarity, MovesWhatWasMeasuredOfRotationsAndGravity) {
  Problem p = drive();
  const Pose first = pose_of(p, 0);
  p.terms.rotations.push_back({.image = 0, .rotation = first.rotation});
  p.terms.gravities.push_back({.image = 0, .down = {0, 0.6, 0.8}});
  p.terms.centres.push_back({.image = 0, .lever_arm = {0.1, 0.2, 0.3}});
  RelativePosePrior relative{.first = 0, .second = 1, .translation = {1, 2, 3}};
  for (std::size_t k = 0; k < 36; ++k) relative.square_root[k] = 1 + static_cast<double>(k);
  p.terms.relative_poses.push_back(relative);
  move(p, kMove);
  const Pose moved_first = pose_of(p, 0);
  for (std::size_t k = 0; k < 4; ++k)
    EXPECT_NEAR(p.terms.rotations[0].rotation[k], moved_first.rotation[k], 1e-15);
  // What the camera sees of a direction of the world stays the same.
  const auto seen = multiply(matrix_from_quaternion(first.rotation), {0, 0.6, 0.8});
  const auto now =
      multiply(matrix_from_quaternion(moved_first.rotation), p.terms.gravities[0].down);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(now[k], seen[k], 1e-14);
    EXPECT_DOUBLE_EQ(p.terms.centres[0].lever_arm[k], 0.25 * static_cast<double>(k + 1));
    EXPECT_DOUBLE_EQ(p.terms.relative_poses[0].translation[k], 2.5 * static_cast<double>(k + 1));
    EXPECT_DOUBLE_EQ(p.terms.relative_poses[0].square_root[k], relative.square_root[k] / 2.5);
    EXPECT_EQ(p.terms.relative_poses[0].square_root[3 + k], relative.square_root[3 + k]);
  }
}

}  // namespace
}  // namespace sheaf
