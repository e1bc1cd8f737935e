// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "scene/rigs.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem drive() {
  RigSceneOptions options;
  options.frames = 60;
  options.single_images = 5;
  options.scene.points = 900;
  return generate(options).value().truth;
}

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

Vector3<double> center_of(const Pose& pose) {
  const Vector3<double> c =
      multiply(matrix_from_quaternion(conjugate(pose.rotation)), pose.translation);
  return {-c[0], -c[1], -c[2]};
}

double turn_between(const Pose& a, const Pose& b) {
  const Vector3<double> phi =
      angle_axis_from_quaternion(multiply(a.rotation, conjugate(b.rotation)));
  return std::hypot(phi[0], phi[1], phi[2]);
}

double apart(const Vector3<double>& a, const Vector3<double>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TEST(RigNoise, ImagesOfARigMoveWithTheirFrames) {
  const Problem before = drive();
  for (const NoiseProtocol protocol :
       {NoiseProtocol::sheaf, NoiseProtocol::ceres, NoiseProtocol::rootba}) {
    NoiseOptions options;
    options.protocol = protocol;
    options.rotation_rad = 0.01;
    (protocol == NoiseProtocol::ceres ? options.translation : options.center) = 0.05;
    Problem after = before;
    ASSERT_TRUE(perturb(after, options).ok());
    ASSERT_TRUE(validate(after).ok());
    double turns = 0;
    for (std::size_t f = 0; f < before.rigs.num_frames(); ++f)
      turns += turn_between(after.rigs.rig_from_world[f], before.rigs.rig_from_world[f]);
    // The mean length of a vector of three normal components is 1.6 sigmas.
    EXPECT_NEAR(turns / 60, 0.016, 0.003);
    EXPECT_EQ(after.rigs.sensor_from_rig[1].translation,
              before.rigs.sensor_from_rig[1].translation);
    for (std::size_t j = 0; j < before.num_images(); ++j) {
      EXPECT_EQ(after.poses[j].translation, pose_of(after, j).translation);
      EXPECT_NE(after.poses[j].translation, before.poses[j].translation);
    }
  }
}

TEST(RigNoise, ATurnLeavesTheFramesCentreInPlace) {
  const Problem before = drive();
  NoiseOptions options;
  options.rotation_rad = 0.02;
  Problem after = before;
  ASSERT_TRUE(perturb(after, options).ok());
  for (std::size_t f = 0; f < before.rigs.num_frames(); ++f)
    EXPECT_LT(
        apart(center_of(after.rigs.rig_from_world[f]), center_of(before.rigs.rig_from_world[f])),
        1e-12);
}

TEST(RigNoise, SensorsAreDisturbedOnTheirOwn) {
  const Problem before = drive();
  NoiseOptions options;
  options.sensor_rotation_rad = 0.02;
  options.sensor_translation = 0.03;
  Problem after = before;
  ASSERT_TRUE(perturb(after, options).ok());
  EXPECT_EQ(after.rigs.sensor_from_rig[0].rotation, Pose{}.rotation);
  const double turn = turn_between(after.rigs.sensor_from_rig[1], before.rigs.sensor_from_rig[1]);
  EXPECT_GT(turn, 1e-3);
  EXPECT_LT(turn, 0.1);
  EXPECT_EQ(after.rigs.rig_from_world[3].translation, before.rigs.rig_from_world[3].translation);
  EXPECT_EQ(after.points, before.points);
  for (std::size_t j = 0; j < before.num_images(); ++j)
    EXPECT_EQ(after.poses[j].rotation, pose_of(after, j).rotation);
  // The same numbers whatever else is disturbed.
  options.rotation_rad = 0.01;
  options.pixel_px = 1;
  Problem both = before;
  ASSERT_TRUE(perturb(both, options).ok());
  EXPECT_EQ(both.rigs.sensor_from_rig[1].rotation, after.rigs.sensor_from_rig[1].rotation);
}

TEST(RigNoise, FramesOfOneImageAreAsImagesOfNoRig) {
  SceneOptions scene;
  scene.points = 300;
  Problem plain = generate(scene).value().truth, framed = plain;
  framed.rigs.count = 1;
  framed.rigs.sensor_from_rig = {Pose{}};
  framed.rigs.sensor_rig = {0};
  framed.rigs.is_reference = {1};
  for (std::uint32_t j = 0; j < framed.num_images(); ++j) {
    framed.rigs.rig_from_world.push_back(framed.poses[j]);
    framed.rigs.frame_rig.push_back(0);
    framed.rigs.image_frame.push_back(j);
    framed.rigs.image_sensor.push_back(0);
  }
  NoiseOptions options;
  options.rotation_rad = 0.01;
  options.translation = 0.02;
  options.center = 0.03;
  options.outliers = 0.1;
  ASSERT_TRUE(perturb(plain, options).ok());
  ASSERT_TRUE(perturb(framed, options).ok());
  for (std::size_t j = 0; j < plain.num_images(); ++j) {
    EXPECT_EQ(plain.poses[j].rotation, framed.poses[j].rotation);
    EXPECT_EQ(plain.poses[j].translation, framed.poses[j].translation);
    EXPECT_EQ(framed.rigs.rig_from_world[j].translation, framed.poses[j].translation);
  }
  EXPECT_EQ(plain.bal_angle_axis, framed.bal_angle_axis);
  EXPECT_EQ(plain.observation_xy, framed.observation_xy);
  NoiseOptions sensors;
  sensors.sensor_rotation_rad = 0.01;
  EXPECT_FALSE(perturb(framed, sensors).ok());
  EXPECT_FALSE(perturb(plain, sensors).ok());
}

}  // namespace
}  // namespace sheaf
