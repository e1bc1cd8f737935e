// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/rig_findings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "inspect/check.h"
#include "inspect/statistics.h"
#include "scene/rigs.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem drive(std::uint64_t frames = 30) {
  RigSceneOptions options;
  options.frames = frames;
  options.scene.points = 600;
  return generate(options).value().start;
}

std::vector<Finding> of_rigs(const Problem& problem) {
  FindingList list;
  check_rigs(problem, list);
  return list.findings;
}

/// Without the observations of some images.
template <class Predicate>
void drop_observations(Problem& p, Predicate of_image) {
  Problem kept = p;
  kept.observation_image.clear();
  kept.observation_point.clear();
  kept.observation_xy.clear();
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (!of_image(p.observation_image[i]))
      kept.add_observation(p.observation_image[i], p.observation_point[i], p.observation_xy[2 * i],
                           p.observation_xy[2 * i + 1]);
  p = kept;
}

TEST(RigFindings, OfAGoodDriveAreNone) {
  EXPECT_TRUE(of_rigs(drive()).empty());
  for (const Finding& finding : check(drive())) EXPECT_FALSE(finding.grave) << finding.words;
}

TEST(RigFindings, BlindImagesOfAFrameThatSeesAreFine) {
  Problem p = drive();
  drop_observations(p, [](std::uint32_t j) { return j == 4; });
  for (const Finding& finding : check(p)) EXPECT_NE(finding.code, "blind-images");
  drop_observations(p, [](std::uint32_t j) { return j == 5; });
  const std::vector<Finding> found = of_rigs(p);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "blind-frames");
  EXPECT_TRUE(found[0].grave);
  EXPECT_EQ(found[0].of, "frames");
  EXPECT_EQ(found[0].first, std::vector<std::uint64_t>{2});
}

TEST(RigFindings, FramesAndSensorsWithoutImages) {
  Problem p = drive();
  p.rigs.rig_from_world.push_back(Pose{});
  p.rigs.frame_rig.push_back(0);
  p.rigs.sensor_from_rig.push_back(Pose{});
  p.rigs.sensor_rig.push_back(0);
  p.rigs.is_reference.push_back(0);
  const std::vector<Finding> found = of_rigs(p);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].code, "empty-frames");
  EXPECT_EQ(found[0].first, std::vector<std::uint64_t>{30});
  EXPECT_EQ(found[1].code, "empty-sensors");
  EXPECT_EQ(found[1].first, std::vector<std::uint64_t>{2});
}

TEST(RigFindings, SensorsSeenInFewFrames) {
  Problem p = drive();
  drop_observations(p, [&](std::uint32_t j) {
    return p.rigs.image_sensor[j] == 1 && p.rigs.image_frame[j] >= 3;
  });
  ASSERT_EQ(of_rigs(p).size(), 1u);
  EXPECT_EQ(of_rigs(p)[0].code, "weak-sensors");
  EXPECT_FALSE(of_rigs(p)[0].grave);
  drop_observations(p, [&](std::uint32_t j) { return p.rigs.image_sensor[j] == 1; });
  ASSERT_EQ(of_rigs(p).size(), 1u);
  EXPECT_EQ(of_rigs(p)[0].code, "loose-sensors");
  EXPECT_TRUE(of_rigs(p)[0].grave);
}

TEST(RigFindings, RigsWithoutImagesOfTheReference) {
  Problem p = drive();
  for (std::size_t j = 0; j < p.num_images(); ++j)
    if (p.rigs.image_sensor[j] == 0) p.rigs.image_frame[j] = p.rigs.image_sensor[j] = Rigs::kNone;
  const std::vector<Finding> found = of_rigs(p);
  const auto of = [&](const char* code) {
    return std::any_of(found.begin(), found.end(),
                       [&](const Finding& f) { return f.code == code; });
  };
  EXPECT_TRUE(of("rigs-without-reference"));
  EXPECT_TRUE(of("loose-sensors"));
  EXPECT_TRUE(of("empty-sensors"));
}

TEST(RigFindings, GapsTellWhereStatedPosesAreNotThoseOfTheRig) {
  Problem p = drive();
  PoseGaps gaps = pose_gaps(p);
  EXPECT_LT(*std::max_element(gaps.center.begin(), gaps.center.end()), 1e-12);
  EXPECT_LT(*std::max_element(gaps.rotation_rad.begin(), gaps.rotation_rad.end()), 1e-12);
  // Moved by 0.3 in its own frame, and turned by 0.01 about its own axis.
  p.poses[7].translation[1] += 0.3;
  p.poses[8].rotation =
      multiply(quaternion_from_angle_axis(Vector3<double>{0, 0, 0.01}), p.poses[8].rotation);
  gaps = pose_gaps(p);
  EXPECT_NEAR(gaps.center[7], 0.3, 1e-12);
  EXPECT_NEAR(gaps.rotation_rad[7], 0, 1e-12);
  EXPECT_NEAR(gaps.rotation_rad[8], 0.01, 1e-12);
  EXPECT_EQ(gaps.center.size(), p.num_images());
}

TEST(RigCounts, OfADriveAndOfNone) {
  RigSceneOptions options;
  options.frames = 20;
  options.single_images = 4;
  options.scene.points = 300;
  const RigCounts counts = rig_counts(generate(options).value().truth);
  EXPECT_EQ(counts.rigs, 1u);
  EXPECT_EQ(counts.sensors, 2u);
  EXPECT_EQ(counts.frames, 20u);
  EXPECT_EQ(counts.images, 40u);
  EXPECT_EQ(counts.rigid_frames, 20u);
  EXPECT_EQ(rig_counts(Problem()).images, 0u);
}

}  // namespace
}  // namespace sheaf
