// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_configuration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "io/rig_models.h"

namespace sheaf {
namespace {

using namespace test;

/// The images of a rig as if nobody knew of it.
Problem without_rig(std::uint32_t frames, bool one_camera = false) {
  Problem problem = rig_problem(frames);
  problem.rigs = {};
  auto metadata = std::make_shared<SceneMetadata>();
  for (std::uint32_t f = 0; f < frames; ++f)
    for (const char* side : {"left/", "right/"})
      metadata->image_names.push_back(side + std::to_string(f) + ".png");
  metadata->camera_ids = {4, 9};
  problem.metadata = metadata;
  if (one_camera)
    for (std::uint32_t& camera : problem.image_camera) camera = 0;
  return problem;
}

std::vector<RigConfiguration> stereo() { return {{{{"left/", true, {}}, {"right/", false, {}}}}}; }

void expect_near(const Pose& a, const Pose& b, double tolerance) {
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(a.rotation[k], b.rotation[k], tolerance);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(a.translation[k], b.translation[k], tolerance);
}

TEST(RigConfiguration, FindsTheRigThatTheImagesHad) {
  const Problem truth = rig_problem(5);
  Problem problem = without_rig(5);
  const RigLayout layout = lay_rigs(problem, stereo()).value();
  ASSERT_TRUE(validate(problem).ok());
  EXPECT_EQ(layout.frames, 5u);
  EXPECT_EQ(layout.images, 10u);
  EXPECT_EQ(layout.images_of_no_rig, 0u);
  EXPECT_EQ(layout.copied_cameras, 0u);
  EXPECT_EQ(problem.rigs.image_sensor, truth.rigs.image_sensor);
  EXPECT_EQ(problem.rigs.image_frame, truth.rigs.image_frame);
  expect_near(problem.rigs.sensor_from_rig[1], truth.rigs.sensor_from_rig[1], 1e-14);
  for (std::size_t f = 0; f < 5; ++f)
    EXPECT_EQ(problem.rigs.rig_from_world[f].translation, truth.rigs.rig_from_world[f].translation);
  ASSERT_EQ(layout.sensors.size(), 2u);
  EXPECT_EQ(layout.sensors[1].frames, 5u);
  EXPECT_LT(layout.sensors[1].max_rotation_rad, 1e-7);
  EXPECT_LT(layout.sensors[1].max_translation, 1e-13);
}

/// One image far off does not move the average, and is told; noise does by its mean.
TEST(RigConfiguration, AveragesRobustly) {
  const Problem truth = rig_problem(9);
  Problem problem = without_rig(9);
  for (std::size_t f = 0; f < 8; ++f)
    problem.poses[2 * f + 1].translation[0] += f % 2 == 0 ? 1e-3 : -1e-3;
  problem.poses[17] = pose_at({0.5, 0, 0}, {7, 7, 7});
  const RigLayout layout = lay_rigs(problem, stereo()).value();
  expect_near(problem.rigs.sensor_from_rig[1], truth.rigs.sensor_from_rig[1], 1e-6);
  EXPECT_NEAR(layout.sensors[1].median_translation, 1e-3, 1e-5);
  EXPECT_GT(layout.sensors[1].max_translation, 5);
  EXPECT_GT(layout.sensors[1].max_rotation_rad, 0.3);
}

TEST(RigConfiguration, TakesStatedPosesAndFramesWithoutTheReference) {
  const Problem truth = rig_problem(3);
  Problem problem = without_rig(3);
  auto metadata = std::make_shared<SceneMetadata>(*problem.metadata);
  metadata->image_names[0] = "elsewhere.png";  // frame 0 has its right image alone
  problem.metadata = metadata;
  std::vector<RigConfiguration> rigs = stereo();
  rigs[0].cameras[1].cam_from_rig = truth.rigs.sensor_from_rig[1];
  const RigLayout layout = lay_rigs(problem, rigs).value();
  EXPECT_EQ(layout.images_of_no_rig, 1u);
  EXPECT_EQ(problem.rigs.image_frame[0], Rigs::kNone);
  EXPECT_TRUE(layout.sensors[1].stated);
  expect_near(problem.rigs.rig_from_world[0], truth.rigs.rig_from_world[0], 1e-14);
  expect_near(problem.poses[1], truth.poses[1], 1e-14);
}

TEST(RigConfiguration, SensorsThatShareACameraGetCopies) {
  Problem problem = without_rig(3, true);
  const double cost = evaluate(problem).cost;
  const RigLayout layout = lay_rigs(problem, stereo()).value();
  EXPECT_EQ(layout.copied_cameras, 1u);
  EXPECT_EQ(problem.cameras.size(), 3u);
  EXPECT_EQ(problem.metadata->camera_ids, (std::vector<std::uint32_t>{4, 9, 10}));
  EXPECT_EQ(problem.image_camera, (std::vector<std::uint32_t>{0, 2, 0, 2, 0, 2}));
  EXPECT_NEAR(evaluate(problem).cost, cost, 1e-9 * cost);
  EXPECT_TRUE(parse_colmap(format_colmap(problem, true).value()).ok());
}

TEST(RigConfiguration, RefusesWhatIsNoRigOfTheseImages) {
  const auto message = [](Problem problem, const std::vector<RigConfiguration>& rigs) {
    const std::uint64_t hash = state_hash(problem);
    const Result<RigLayout> layout = lay_rigs(problem, rigs);
    EXPECT_FALSE(layout.ok());
    EXPECT_EQ(state_hash(problem), hash);
    return layout.ok() ? std::string() : std::string(layout.error().what());
  };
  const auto expect = [](const std::string& said, const char* words) {
    EXPECT_NE(said.find(words), std::string::npos) << said;
  };
  expect(message(rig_problem(2), stereo()), "has rigs already");
  Problem nameless = without_rig(2);
  nameless.metadata = nullptr;
  expect(message(nameless, stereo()), "no names");
  expect(message(without_rig(2), {{{{"left/", true, {}}, {"middle/", false, {}}}}}),
         "no image's name begins with 'middle/'");
  expect(message(without_rig(2), {{{{"left/", true, {}}, {"le", false, {}}}}}),
         "begins with two prefixes");
  expect(message(without_rig(2), {{{{"left/", false, {}}}}}), "0 reference sensors");
  Problem mixed = without_rig(2);
  mixed.image_camera[2] = 1;
  expect(message(mixed, stereo()), "'left/' have several cameras");
  Problem apart = without_rig(2);
  auto metadata = std::make_shared<SceneMetadata>(*apart.metadata);
  metadata->image_names = {"left/a", "right/b", "left/c", "right/d"};
  apart.metadata = metadata;
  expect(message(apart, stereo()), "nothing says where the camera with the prefix 'right/'");
}

}  // namespace
}  // namespace sheaf
