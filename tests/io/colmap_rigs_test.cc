// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "inspect/check.h"
#include "io/bytes.h"
#include "io/colmap.h"
#include "io/rig_models.h"
#include "scene/subset.h"
#include "sheaf/io.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

using namespace test;

void expect_same_files(const ColmapFiles& a, const ColmapFiles& b) {
  EXPECT_EQ(a.cameras, b.cameras);
  EXPECT_EQ(a.images, b.images);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.rigs, b.rigs);
  EXPECT_EQ(a.frames, b.frames);
}

void expect_same_poses(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].rotation, b[i].rotation) << i;
    EXPECT_EQ(a[i].translation, b[i].translation) << i;
  }
}

TEST(ColmapRigs, AProblemsRigsComeBackInBothForms) {
  const Problem problem = rig_problem();
  for (const bool text : {false, true}) {
    const ColmapFiles files = format_colmap(problem, text).value();
    const Problem again = parse_colmap(files).value();
    ASSERT_TRUE(validate(again).ok());
    EXPECT_EQ(again.rigs.count, 1u);
    expect_same_poses(again.poses, problem.poses);
    expect_same_poses(again.rigs.sensor_from_rig, problem.rigs.sensor_from_rig);
    expect_same_poses(again.rigs.rig_from_world, problem.rigs.rig_from_world);
    EXPECT_EQ(again.rigs.image_frame, problem.rigs.image_frame);
    EXPECT_EQ(again.rigs.image_sensor, problem.rigs.image_sensor);
    EXPECT_EQ(again.rigs.is_reference, problem.rigs.is_reference);
    EXPECT_EQ(again.metadata->rig_ids, (std::vector<std::uint32_t>{1}));
    EXPECT_EQ(again.metadata->frame_ids, (std::vector<std::uint32_t>{1, 2, 3, 4}));
    EXPECT_EQ(again.metadata->sensor_ids, (std::vector<std::uint32_t>{1, 2}));
    EXPECT_TRUE(again.metadata->stale_poses.empty());
    expect_same_files(format_colmap(again, text).value(), files);
    expect_same_files(
        format_colmap(parse_colmap(format_colmap(again, !text).value()).value(), text).value(),
        files);
    EXPECT_TRUE(lost_in(text ? "colmap" : "colmap-text", again).empty());
    ASSERT_EQ(lost_in("bundler", again).size() > 0, true);
    EXPECT_EQ(lost_in("bundler", again)[0], "rigs and frames are not written");
  }
}

TEST(ColmapRigs, FramesHoldTheTruthAndStalePosesAreNamed) {
  const ColmapFiles text = tiny_rigs();
  const Problem problem = parse_colmap(text).value();
  ASSERT_TRUE(validate(problem).ok());
  EXPECT_EQ(problem.rigs.count, 1u);
  EXPECT_EQ(problem.rigs.is_reference, (std::vector<std::uint8_t>{0, 0}));
  EXPECT_EQ(problem.metadata->rig_ids, (std::vector<std::uint32_t>{5}));
  EXPECT_EQ(problem.metadata->frame_ids, (std::vector<std::uint32_t>{20, 21}));
  EXPECT_EQ(problem.metadata->sensor_ids, (std::vector<std::uint32_t>{7, 3}));
  EXPECT_EQ(problem.rigs.image_frame, (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(problem.rigs.image_sensor, (std::vector<std::uint32_t>{0, 1, 1}));
  EXPECT_EQ(problem.poses[1].translation[0], 2);
  EXPECT_EQ(problem.poses[2].translation[0], 1.5);
  EXPECT_EQ(problem.metadata->stale_poses, (std::vector<std::uint32_t>{1}));
  const std::vector<Finding> findings = check(problem);
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.code == "stale-poses" && !finding.grave && finding.count == 1;
  }));
  // What nothing changed comes back as it was, the stale pose too.
  expect_same_files(format_colmap(problem, true).value(), text);
  // In the other form the pose is the right one; rigs and frames are all there.
  const Problem binary = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_TRUE(binary.metadata->stale_poses.empty());
  EXPECT_TRUE(same_state(binary, problem));
  const ColmapFiles back = format_colmap(binary, true).value();
  EXPECT_NE(back.rigs.find("\n5 4 IMU 7 CAMERA 7 1 1 0 0 0 0 0 0 CAMERA 3 1 1 0 0 0 1 0 0 IMU 3 "
                           "0\n8 2 IMU 1 CAMERA 3 0\n"),
            std::string::npos)
      << back.rigs;
  EXPECT_NE(back.frames.find("\n20 5 0.8 0.6 0 0 0.5 0.25 5 3 CAMERA 7 12 IMU 7 99 CAMERA 3 9\n"),
            std::string::npos)
      << back.frames;
  EXPECT_NE(back.frames.find("\n22 8 0.5 0.5 0.5 0.5 0 0 0 1 IMU 1 4\n"), std::string::npos);
}

TEST(ColmapRigs, WhatMovedIsStatedAnewLineByLine) {
  const ColmapFiles text = tiny_rigs();
  Problem problem = parse_colmap(text).value();
  problem.rigs.rig_from_world[0].translation[0] = 0.75;  // images 12 and 9
  place_images(problem);
  const ColmapFiles now = format_colmap(problem, true).value();
  EXPECT_EQ(now.rigs, text.rigs);
  std::string frames = text.frames;
  frames.replace(frames.find("20 5 0.80 0.6 0 0 0.5"), 21, "20 5 0.8 0.6 0 0 0.75");
  EXPECT_EQ(now.frames, frames);
  // The stale pose of image 4 goes with the first change.
  EXPECT_NE(now.images.find("\n4 0.8 0.6 0 0 2 0.25 5 3 b.png\n"), std::string::npos);
  EXPECT_NE(now.images.find("\n12 0.8 0.6 0 0 0.75 0.25 5 7 left image.png\n"), std::string::npos);
  const Problem again = parse_colmap(now).value();
  EXPECT_TRUE(same_state(again, problem));
  EXPECT_TRUE(again.metadata->stale_poses.empty());
  problem.rigs.sensor_from_rig[1].translation = {1.0 / 3, 0, 0};
  place_images(problem);
  EXPECT_NE(
      format_colmap(problem, true)
          .value()
          .rigs.find(
              " CAMERA 7 1 1 0 0 0 0 0 0 CAMERA 3 1 1 0 0 0 0.3333333333333333 0 0 IMU 3 0\n"),
      std::string::npos);
  EXPECT_EQ(parse_colmap(format_colmap(problem, false).value())
                .value()
                .rigs.sensor_from_rig[1]
                .translation[0],
            1.0 / 3);
}

TEST(ColmapRigs, CleaningLeavesThemAsTheyStood) {
  ColmapFiles text = tiny_rigs();
  text.images.replace(text.images.find("0.8 0.6 0 0 -.5"), 15, "0.8 0.6 0 0 2.0");  // not stale
  Problem problem = parse_colmap(text).value();
  EXPECT_TRUE(problem.metadata->stale_poses.empty());
  std::vector<bool> kept(problem.num_observations(), true);
  kept[2] = false;
  keep_observations(problem, kept, 1);
  ASSERT_EQ(problem.num_points(), 1u);
  const ColmapFiles now = format_colmap(problem, true).value();
  EXPECT_EQ(now.rigs, text.rigs);
  EXPECT_EQ(now.frames, text.frames);
  EXPECT_EQ(now.cameras, text.cameras);
  std::string images = text.images;
  images.replace(images.find("300.5 200.25 41 10 20 -1 310.50 210.25 5"), 40,
                 "300.5 200.25 41 10 20 -1 310.5 210.25 -1");
  EXPECT_EQ(now.images, images);
  EXPECT_EQ(now.points.rfind("# another\n41 0.125 ", 0), 0u);
  EXPECT_NE(now.points.find("# the end\n"), std::string::npos);
  EXPECT_EQ(now.points.find("\n5 "), std::string::npos);
}

TEST(ColmapRigs, FilesWithoutARecordCountAsNone) {
  ColmapFiles text = tiny_text();
  text.rigs = "# Number of rigs: 0\n";
  text.frames = "# Number of frames: 0\n";
  Problem problem = parse_colmap(text).value();
  EXPECT_TRUE(problem.rigs.empty());
  expect_same_files(format_colmap(problem, true).value(), text);
  problem.poses[0].translation[0] += 1;
  EXPECT_EQ(format_colmap(problem, true).value().frames, text.frames);
  EXPECT_EQ(format_colmap(problem, false).value().frames, "");
  EXPECT_TRUE(lost_in("colmap", problem).empty());
  const Folder folder;
  write(problem, folder / "m", {.format = "colmap-text"}).value();
  spill(folder / "m/rigs.txt", "");
  spill(folder / "m/frames.txt", "");
  EXPECT_TRUE(read_file(folder / "m").ok());
}

TEST(ColmapRigs, TrivialFramesFollowTheirImagesInBothForms) {
  ColmapFiles binary = tiny_binary();
  binary.rigs = rigs_binary();
  binary.frames = frames_binary();
  Problem problem = parse_colmap(binary).value();
  EXPECT_TRUE(problem.rigs.empty());
  problem.poses[1].translation[0] = 0.75;  // image 4
  const ColmapFiles text = format_colmap(problem, true).value();
  EXPECT_NE(text.frames.find("\n4 3 0.8 0.6 0 0 0.75 0.25 5 1 CAMERA 3 4\n"), std::string::npos)
      << text.frames;
  EXPECT_TRUE(same_state(parse_colmap(text).value(), problem));
  const std::vector<std::string> lost = lost_in("colmap-text", problem);
  ASSERT_EQ(lost.size(), 1u);
  EXPECT_TRUE(lost[0].starts_with("1 image names have blanks")) << lost[0];
}

TEST(ColmapRigs, ImagesOfNoRigBecomeFrames) {
  Problem problem = rig_problem(2);
  const Pose alone = pose_at({0, 0.2, 0.1}, {0.3, 0.1, 6});
  problem.cameras.push_back(problem.cameras[0]);
  for (const std::uint32_t camera : {2u, 2u, 0u, 1u}) {
    problem.add_image(alone, camera);
    problem.rigs.image_frame.push_back(Rigs::kNone);
    problem.rigs.image_sensor.push_back(Rigs::kNone);
  }
  ASSERT_TRUE(validate(problem).ok());
  EXPECT_EQ(lost_in("colmap", problem).size(), 1u);
  const Problem again = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_EQ(again.rigs.count, 2u);
  EXPECT_EQ(again.rigs.num_frames(), 6u);
  for (std::size_t j = 4; j < 8; ++j)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(again.poses[j].translation[k], alone.translation[k], 1e-14);
  expect_same_poses({again.poses[4], again.poses[6]}, {alone, alone});
  EXPECT_EQ(again.rigs.frame_rig, (std::vector<std::uint32_t>{0, 0, 1, 1, 0, 0}));
}

TEST(ColmapRigs, WhatColmapCannotStateIsRefused) {
  Problem lenses = rig_problem();
  lenses.image_camera[2] = 1;
  const auto message = [](const Problem& problem) {
    const Result<ColmapFiles> files = format_colmap(problem, false);
    EXPECT_FALSE(files.ok());
    if (files.ok()) return std::string();
    EXPECT_EQ(files.error().code(), ErrorCode::usage);
    return std::string(files.error().what());
  };
  EXPECT_NE(message(lenses).find("sensor 0 has images through camera 0 and camera 1"),
            std::string::npos);
  Problem shared = rig_problem();
  for (std::uint32_t& camera : shared.image_camera) camera = 0;
  EXPECT_NE(message(shared).find("sensors 0 and 1 of rig 0 have one camera"), std::string::npos);
  Problem headless = rig_problem();
  headless.rigs.is_reference[0] = 0;
  EXPECT_NE(message(headless).find("no reference sensor"), std::string::npos);
}

TEST(ColmapRigs, BrokenRigsAreRefusedWithTheirPlace) {
  const std::pair<std::pair<const char*, const char*>, const char*> frames[] = {
      {{"CAMERA 3 9", "CAMERA 3 98"},
       "m/frames.txt:2: found image id 98 in frame 20, expected the"},
      {{"CAMERA 3 9", "CAMERA 7 9"}, "m/frames.txt:2: found image id 9 in frame 20 by camera 7"},
      {{"CAMERA 3 4", "CAMERA 3 9"}, "found image id 9 in frame 21, which frame 20 has too"},
      {{"21 5", "20 5"}, "m/frames.txt:3: found frame 20 a second time"},
      {{"21 5", "21 6"}, "m/frames.txt:3: found rig id 6 of frame 21"},
      {{"21 5", "21 8"}, "camera 3 in frame 21, expected a sensor of rig 8 that has a pose in"},
      {{"1 CAMERA 3 4", "0"}, "m/frames.txt: found no frame with image id 4"},
      {{"21 5 0.8 0.6", "21 5 0 0"}, "m/frames.txt:3: found a quaternion of no direction"},
      {{"CAMERA 3 9", "LIDAR 3 9"},
       "m/frames.txt:2: found 'LIDAR', expected the type of a sensor"}};
  for (const auto& [change, expected] : frames) {
    ColmapFiles text = tiny_rigs();
    text.frames.replace(text.frames.find(change.first), std::string(change.first).size(),
                        change.second);
    const Result<Problem> problem = parse_colmap(text);
    ASSERT_FALSE(problem.ok()) << expected;
    EXPECT_EQ(problem.error().code(), ErrorCode::unreadable_input);
    EXPECT_NE(std::string(problem.error().what()).find(expected), std::string::npos)
        << problem.error().what();
  }
  ColmapFiles text = tiny_rigs();
  text.rigs.replace(text.rigs.find("CAMERA 3 1 1"), 8, "CAMERA 4");
  EXPECT_NE(std::string(parse_colmap(text).error().what()).find("m/rigs.txt:2: found camera id 4"),
            std::string::npos);
}

/// An image's pose is turned with its rig where BAL cameras become COLMAP's.
TEST(ColmapRigs, BalCamerasTurnTheirRigs) {
  Problem problem = rig_problem();
  for (Camera& camera : problem.cameras) camera = {CameraModel::bal, {500, 0.01, 0}};
  for (Pose& frame : problem.rigs.rig_from_world) frame.translation[2] = -5;
  place_images(problem);
  const double cost = evaluate(problem).cost;
  const Problem again = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_NEAR(evaluate(again).cost, cost, 1e-9 * cost);
  EXPECT_TRUE(again.metadata->stale_poses.empty());
  EXPECT_EQ(again.rigs.is_reference, problem.rigs.is_reference);
}

TEST(ColmapRigs, NormalisingScalesThem) {
  Problem problem = rig_problem();
  problem.terms.centres.push_back({1, {0.5, 0.25, -4}, {4, 0, 0, 0, 4, 0, 0, 0, 4}, {}});
  const double cost = evaluate(problem).cost;
  const Pose sensor = problem.rigs.sensor_from_rig[1];
  const Normalization by = normalize(problem, 100).value();
  EXPECT_NEAR(evaluate(problem).cost, cost, 1e-9 * cost);
  EXPECT_EQ(problem.rigs.sensor_from_rig[1].translation[0], by.scale * sensor.translation[0]);
  EXPECT_EQ(problem.rigs.sensor_from_rig[1].rotation, sensor.rotation);
  EXPECT_NEAR(problem.terms.centres[0].position[2], by.scale * (-4 - by.center[2]), 1e-12);
  EXPECT_NEAR(problem.terms.centres[0].covariance[4], 4 * by.scale * by.scale, 1e-9);
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    EXPECT_EQ(problem.poses[j].translation, pose_of(problem, j).translation);
}

TEST(ColmapRigs, SubsetsKeepSigmasAndTerms) {
  Problem problem = rig_problem();
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    problem.observation_sigma.push_back(1 + static_cast<double>(i));
  problem.terms.points = {{0, {}, kUnitCovariance3}, {3, {}, kUnitCovariance3}};
  problem.terms.distances = {{0, 1, 1, 1, {}}, {3, 4, 1, 1, {}}};
  problem.terms.kept_points = {0, 5};
  std::vector<bool> kept(problem.num_observations(), true);
  for (std::size_t i = 0; i < kept.size(); ++i) kept[i] = problem.observation_point[i] != 0;
  keep_observations(problem, kept, 1);
  ASSERT_TRUE(validate(problem).ok());
  EXPECT_EQ(problem.observation_sigma[0], 2);
  ASSERT_EQ(problem.terms.points.size(), 1u);
  EXPECT_EQ(problem.terms.points[0].point, 2u);
  ASSERT_EQ(problem.terms.distances.size(), 1u);
  EXPECT_EQ(problem.terms.distances[0].first, 2u);
  EXPECT_EQ(problem.terms.kept_points, (std::vector<std::uint32_t>{4}));
  const auto lost = lost_in("colmap", problem);
  ASSERT_EQ(lost.size(), 2u);
  EXPECT_EQ(lost[0], "sigmas of observations are not written");
}

}  // namespace
}  // namespace sheaf
