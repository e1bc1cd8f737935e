// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "geometry/camera_model.h"
#include "scene/rigs.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

RigSceneOptions options_of(RigKind kind, std::uint64_t frames = 40) {
  RigSceneOptions options;
  options.kind = kind;
  options.frames = frames;
  options.scene.points = 1500;
  options.scene.mean_track = 6;
  return options;
}

void expect_truth(const Scene& scene) {
  ASSERT_TRUE(validate(scene.start).ok()) << validate(scene.start).error().what();
  ASSERT_TRUE(validate(scene.truth).ok());
  const Evaluation truth = evaluate(scene.truth);
  EXPECT_LT(truth.rms_px, 1e-9);
  EXPECT_TRUE(truth.behind.empty());
  EXPECT_TRUE(truth.not_finite.empty());
  std::vector<int> counts(scene.truth.num_images(), 0);
  for (const std::uint32_t j : scene.truth.observation_image) ++counts[j];
  EXPECT_GE(*std::min_element(counts.begin(), counts.end()), 12);
  EXPECT_TRUE(evaluate(scene.start).not_finite.empty());
}

// FNV-1a over poses, lenses, points and measurements.
std::uint64_t hash_of(const Problem& problem) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&](const auto& numbers) {
    for (const double x : numbers) hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u;
  };
  for (const auto* motions :
       {&problem.poses, &problem.rigs.sensor_from_rig, &problem.rigs.rig_from_world})
    for (const Pose& pose : *motions) add(pose.rotation), add(pose.translation);
  for (const Camera& camera : problem.cameras) add(camera.parameters);
  add(problem.points);
  add(problem.observation_xy);
  return hash;
}

class RigScenes : public testing::TestWithParam<std::size_t> {};

TEST_P(RigScenes, TruthIsExactForEveryModel) {
  const auto model = static_cast<CameraModel>(GetParam());
  for (const RigKind kind : {RigKind::stereo, RigKind::around}) {
    RigSceneOptions options = options_of(kind);
    options.model = model;
    if (model == CameraModel::bal) {
      EXPECT_FALSE(generate(options).ok());
      continue;
    }
    const Scene scene = generate(options).value();
    expect_truth(scene);
    EXPECT_EQ(scene.truth.cameras[0].model, model);
    EXPECT_NEAR(static_cast<double>(scene.truth.num_observations()), 9000, 450);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, RigScenes, testing::Range<std::size_t>(0, kCameraModels),
                         [](const auto& info) {
                           return std::string(to_string(static_cast<CameraModel>(info.param)));
                         });

TEST(RigScene, RigsAreAsAskedFor) {
  RigSceneOptions options = options_of(RigKind::around);
  const Scene scene = generate(options).value();
  const Rigs& rigs = scene.truth.rigs;
  EXPECT_EQ(rigs.count, 1u);
  EXPECT_EQ(rigs.num_sensors(), 6u);
  EXPECT_EQ(rigs.num_frames(), 40u);
  EXPECT_EQ(scene.truth.num_images(), 240u);
  EXPECT_EQ(scene.truth.cameras.size(), 6u);
  EXPECT_EQ(scene.start.rigs.sensor_from_rig[3].translation, rigs.sensor_from_rig[3].translation);
  EXPECT_NE(scene.start.rigs.rig_from_world[3].translation, rigs.rig_from_world[3].translation);
  for (std::size_t j = 0; j < scene.truth.num_images(); ++j) {
    EXPECT_EQ(scene.truth.image_camera[j], rigs.image_sensor[j]);
    EXPECT_EQ(scene.start.poses[j].translation, pose_of(scene.start, j).translation);
  }
  options.sensors = 4;
  options.one_lens = true;
  const Scene four = generate(options).value();
  EXPECT_EQ(four.truth.num_images(), 160u);
  EXPECT_EQ(four.truth.cameras.size(), 1u);
}

TEST(RigScene, TracksCrossFramesAndSensors) {
  for (const RigKind kind : {RigKind::stereo, RigKind::around}) {
    const Problem truth = generate(options_of(kind)).value().truth;
    std::vector<std::set<std::uint32_t>> frames(truth.num_points()), sensors(truth.num_points());
    for (std::size_t i = 0; i < truth.num_observations(); ++i) {
      const std::uint32_t j = truth.observation_image[i];
      frames[truth.observation_point[i]].insert(truth.rigs.image_frame[j]);
      sensors[truth.observation_point[i]].insert(truth.rigs.image_sensor[j]);
    }
    const auto several = [](const std::set<std::uint32_t>& of) { return of.size() > 1; };
    EXPECT_GT(std::count_if(frames.begin(), frames.end(), several), 1200);
    EXPECT_GT(std::count_if(sensors.begin(), sensors.end(), several), 400);
  }
}

TEST(RigScene, SensorsAreDisturbedAloneAndTheReferenceStays) {
  RigSceneOptions options = options_of(RigKind::stereo);
  const Scene calibrated = generate(options).value();
  options.sensor_rotation_noise_rad = 0.01;
  options.sensor_translation_noise = 0.02;
  const Scene disturbed = generate(options).value();
  EXPECT_EQ(state_hash(calibrated.truth), state_hash(disturbed.truth));
  const Rigs &a = calibrated.start.rigs, &b = disturbed.start.rigs;
  EXPECT_EQ(a.rig_from_world[7].rotation, b.rig_from_world[7].rotation);
  EXPECT_EQ(b.sensor_from_rig[0].rotation, Pose{}.rotation);
  EXPECT_NE(a.sensor_from_rig[1].rotation, b.sensor_from_rig[1].rotation);
  EXPECT_NE(a.sensor_from_rig[1].translation, b.sensor_from_rig[1].translation);
  EXPECT_EQ(calibrated.start.points, disturbed.start.points);
  expect_truth(disturbed);
}

TEST(RigScene, FramesMissSensorsAndSingleImagesStandBetween) {
  RigSceneOptions options = options_of(RigKind::stereo, 50);
  options.missing = 0.3;
  options.single_images = 7;
  const Scene scene = generate(options).value();
  expect_truth(scene);
  const Rigs& rigs = scene.truth.rigs;
  std::size_t singles = 0;
  for (const std::uint32_t frame : rigs.image_frame) singles += frame == Rigs::kNone ? 1 : 0;
  EXPECT_EQ(singles, 7u);
  const std::size_t missed = 100 + 7 - scene.truth.num_images();
  EXPECT_GT(missed, 6u);
  EXPECT_LT(missed, 25u);
  EXPECT_EQ(scene.truth.cameras.size(), 3u);
  EXPECT_NE(scene.start.poses.back().translation, scene.truth.poses.back().translation);
  EXPECT_EQ(scene.truth.metadata->image_names[1].substr(0, 5), "rig1/");
}

TEST(RigScene, ALongDriveIsALoop) {
  RigSceneOptions options = options_of(RigKind::stereo, 200);
  options.scene.points = 4000;
  const Scene scene = generate(options).value();
  expect_truth(scene);
  const Problem& truth = scene.truth;
  // Some points are seen by the first frames and by the last.
  std::vector<int> early(truth.num_points(), 0), late(truth.num_points(), 0);
  for (std::size_t i = 0; i < truth.num_observations(); ++i) {
    const std::uint32_t frame = truth.rigs.image_frame[truth.observation_image[i]];
    if (frame < 10) early[truth.observation_point[i]] = 1;
    if (frame >= 190) late[truth.observation_point[i]] = 1;
  }
  int both = 0;
  for (std::size_t p = 0; p < early.size(); ++p) both += early[p] * late[p];
  EXPECT_GT(both, 10);
}

TEST(RigScene, HasTheSameBitsOnEveryMachine) {
  RigSceneOptions options = options_of(RigKind::around, 20);
  options.sensor_rotation_noise_rad = 0.01;
  options.single_images = 3;
  const Scene scene = generate(options).value();
  EXPECT_EQ(hash_of(scene.truth), 2324610322723572317u);
  EXPECT_EQ(hash_of(scene.start), 995000354353255461u);
  options.scene.seed = 2;
  EXPECT_NE(hash_of(generate(options).value().start), hash_of(scene.start));
}

TEST(RigScene, OptionsThatCannotBeMetAreRefused) {
  RigSceneOptions options = options_of(RigKind::stereo);
  options.frames = 1;
  EXPECT_FALSE(generate(options).ok());
  options = options_of(RigKind::stereo);
  options.missing = 1.5;
  EXPECT_FALSE(generate(options).ok());
  options = options_of(RigKind::stereo);
  options.sensor_rotation_noise_rad = -1;
  EXPECT_FALSE(generate(options).ok());
  options = options_of(RigKind::stereo);
  options.scene.mean_track = 41;
  EXPECT_FALSE(generate(options).ok());
  options = options_of(RigKind::stereo);
  options.field_of_view_deg = 170;
  EXPECT_FALSE(generate(options).ok());
}

}  // namespace
}  // namespace sheaf
