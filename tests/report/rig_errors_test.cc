// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/rig_errors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "scene/rigs.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Scene drive(RigKind kind = RigKind::stereo) {
  RigSceneOptions options;
  options.kind = kind;
  options.frames = 40;
  options.single_images = 3;
  options.scene.points = 600;
  options.sensor_rotation_noise_rad = 0.01;
  options.sensor_translation_noise = 0.02;
  return generate(options).value();
}

TEST(RigErrors, OfTheTruthAreNone) {
  const Problem truth = drive().truth;
  const StateErrors errors = compare_states(truth, truth, false).value();
  EXPECT_TRUE(errors.has_rigs);
  EXPECT_LT(errors.frame_rotation_error_rad.max, 1e-12);
  EXPECT_EQ(errors.frame_center_error.max, 0);
  EXPECT_LT(errors.sensor_rotation_error_rad.max, 1e-12);
  EXPECT_EQ(errors.sensor_translation_error.max, 0);
}

TEST(RigErrors, CountFramesAndSensorsThatAreNoReferences) {
  const Scene scene = drive(RigKind::around);
  const ErrorLists lists = list_errors(scene.start, scene.truth, AlignBy::nothing).value();
  EXPECT_EQ(lists.rotation_rad.size(), 243u);
  EXPECT_EQ(lists.rigs.frame_rotation_rad.size(), 40u);
  EXPECT_EQ(lists.rigs.frame_center.size(), 40u);
  EXPECT_EQ(lists.rigs.sensor_rotation_rad.size(), 5u);
  EXPECT_EQ(lists.rigs.sensor_translation.size(), 5u);
  // A frame is where its reference is: the first image of each.
  EXPECT_NEAR(lists.rigs.frame_center[0], lists.center[0], 1e-12);
  EXPECT_NEAR(lists.rigs.frame_rotation_rad[0], lists.rotation_rad[0], 1e-12);
  EXPECT_GT(lists.rigs.sensor_rotation_rad[2], 1e-3);
  EXPECT_LT(lists.rigs.sensor_rotation_rad[2], 0.1);
}

TEST(RigErrors, AreAlignedWithTheImages) {
  const Problem truth = drive().truth;
  Problem moved = truth;
  // Twice the size, elsewhere.
  for (double& x : moved.points) x = 2 * x + 1;
  for (Pose& sensor : moved.rigs.sensor_from_rig)
    for (double& t : sensor.translation) t *= 2;
  const auto move = [](Pose& pose) {
    const Vector3<double> shift =
        multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{1, 1, 1});
    for (std::size_t k = 0; k < 3; ++k) pose.translation[k] = 2 * pose.translation[k] - shift[k];
  };
  for (Pose& frame : moved.rigs.rig_from_world) move(frame);
  for (std::size_t j = 0; j < moved.num_images(); ++j)
    if (!in_rig(moved.rigs, j)) move(moved.poses[j]);
  place_images(moved);
  const StateErrors errors = compare_states(moved, truth, true).value();
  EXPECT_NEAR(errors.scale, 0.5, 1e-9);
  EXPECT_LT(errors.center_error.max, 1e-9);
  EXPECT_LT(errors.frame_center_error.max, 1e-9);
  EXPECT_LT(errors.frame_rotation_error_rad.max, 1e-9);
  EXPECT_LT(errors.sensor_translation_error.max, 1e-9);
  EXPECT_GT(compare_states(moved, truth, false).value().sensor_translation_error.max, 0.4);
}

TEST(RigErrors, FramesAndSensorsAreToldByTheirImages) {
  const Scene scene = drive();
  Problem other = scene.start;
  Rigs& rigs = other.rigs;
  // The same rig with its frames and sensors in another order.
  std::reverse(rigs.rig_from_world.begin(), rigs.rig_from_world.end());
  std::reverse(rigs.sensor_from_rig.begin(), rigs.sensor_from_rig.end());
  std::reverse(rigs.is_reference.begin(), rigs.is_reference.end());
  for (std::uint32_t& frame : rigs.image_frame)
    if (frame != Rigs::kNone) frame = static_cast<std::uint32_t>(rigs.num_frames()) - 1 - frame;
  for (std::uint32_t& sensor : rigs.image_sensor)
    if (sensor != Rigs::kNone) sensor = 1 - sensor;
  const ErrorLists a = list_errors(scene.start, scene.truth, AlignBy::nothing).value();
  const ErrorLists b = list_errors(other, scene.truth, AlignBy::nothing).value();
  EXPECT_EQ(a.rigs.frame_center, b.rigs.frame_center);
  EXPECT_EQ(a.rigs.sensor_rotation_rad, b.rigs.sensor_rotation_rad);
}

TEST(RigErrors, AreNoneWhereRigsGroupImagesOtherwise) {
  const Problem truth = drive().truth;
  Problem other = truth;
  std::swap(other.rigs.image_frame[0], other.rigs.image_frame[4]);
  EXPECT_FALSE(compare_states(other, truth, false).value().has_rigs);
  other.rigs = {};
  EXPECT_FALSE(compare_states(other, truth, false).value().has_rigs);
  EXPECT_FALSE(compare_states(truth, other, false).value().has_rigs);
}

}  // namespace
}  // namespace sheaf
