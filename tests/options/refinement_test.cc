// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What is refined and held of rigs; end_to_end/refinement_test.cc has the rest.
#include "options/refinement.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

using Ids = std::vector<std::uint32_t>;

Problem drive() {
  RigSceneOptions options;
  options.kind = RigKind::around;
  options.sensors = 3;
  options.frames = 10;
  options.single_images = 1;
  options.scene.points = 200;
  Problem problem = generate(options).value().start;
  auto metadata = std::make_shared<SceneMetadata>(*problem.metadata);
  metadata->sensor_ids = {11, 12, 13};
  problem.metadata = metadata;
  return problem;
}

Fixed held(const std::vector<std::string>& fix, const std::vector<std::string>& refine = {}) {
  const Problem problem = drive();
  const RefinementArguments arguments{fix, refine};
  return fixed_of(refinement_of(arguments, problem).value(), problem);
}

std::string complaint(const std::vector<std::string>& fix,
                      const std::vector<std::string>& refine = {}) {
  const Result<Refinement> result = refinement_of({fix, refine}, drive());
  return result.ok() ? "" : result.error().what();
}

TEST(RefinementOfRigs, SensorsMoveByDefault) {
  const Fixed fixed = held({});
  EXPECT_FALSE(fixed.sensors);
  EXPECT_TRUE(fixed.sensor_ids.empty());
  EXPECT_FALSE(fixed.poses);
  EXPECT_TRUE(fixed.frame_ids.empty());
}

TEST(RefinementOfRigs, SensorsAreHeldAllOrByTheIdsOfTheirCameras) {
  EXPECT_TRUE(held({"sensor_from_rig"}).sensors);
  EXPECT_TRUE(held({"sensor_from_rig"}).sensor_ids.empty());
  EXPECT_EQ(held({"sensor_from_rig=12"}).sensor_ids, Ids{1});
  EXPECT_EQ(held({"sensor_from_rig"}, {"sensor_from_rig=12"}).sensor_ids, Ids{2});
  EXPECT_TRUE(held({"sensor_from_rig=12", "sensor_from_rig=13"}).sensors);
  EXPECT_EQ(held({"sensor_from_rig=rig1/camera3/*"}).sensor_ids, Ids{2});
  const Problem problem = drive();
  EXPECT_EQ(held_text(refinement_of({{"sensor_from_rig=13"}, {}}, problem).value(), problem)
                .substr(0, 36),
            "sensor_from_rig of 1 of 2 sensors; c");
}

TEST(RefinementOfRigs, SensorsCountFromZeroWhereNoFileNumbersThem) {
  Problem problem = drive();
  problem.metadata = nullptr;
  const RefinementArguments arguments{{"sensor_from_rig=2"}, {}};
  EXPECT_EQ(fixed_of(refinement_of(arguments, problem).value(), problem).sensor_ids, Ids{2});
}

TEST(RefinementOfRigs, NamesThatAreNotThereAreRefused) {
  EXPECT_NE(complaint({"sensor_from_rig=99"}).find("no sensor of a rig has the id 99"),
            std::string::npos);
  EXPECT_NE(complaint({"sensor_from_rig=11"}).find("never moves"), std::string::npos);
  EXPECT_NE(complaint({"sensor_from_rig"}, {"sensor_from_rig"}).find("contradict"),
            std::string::npos);
  const Result<Refinement> none = refinement_of({{"sensor_from_rig=0"}, {}}, Problem());
  ASSERT_FALSE(none.ok());
  EXPECT_NE(std::string(none.error().what()).find("no rigs"), std::string::npos);
  EXPECT_TRUE(refinement_of({{"sensor_from_rig"}, {}}, Problem()).ok());
}

TEST(RefinementOfRigs, PosesHoldFramesAndNotSensors) {
  const Fixed fixed = held({"poses"});
  EXPECT_TRUE(fixed.poses);
  EXPECT_TRUE(fixed.pose_ids.empty());
  EXPECT_TRUE(fixed.frame_ids.empty());
  EXPECT_FALSE(fixed.sensors);
}

TEST(RefinementOfRigs, ANamedImageHoldsItsFrameAndItsSensor) {
  const Fixed fixed = held({"pose=rig1/camera2/image000004.png"});
  // After three images of each of three frames and the one of no rig.
  EXPECT_EQ(fixed.pose_ids, Ids{11});
  EXPECT_TRUE(fixed.frame_ids.empty());
}

TEST(RefinementOfRigs, AFrameMovesWhereOneOfItsImagesIsNamedTo) {
  const Fixed fixed = held({"poses"}, {"pose=rig1/camera2/image000004.png"});
  EXPECT_FALSE(fixed.poses);
  EXPECT_EQ(fixed.frame_ids, (Ids{0, 1, 2, 4, 5, 6, 7, 8, 9}));
  // The image of no rig.
  EXPECT_EQ(fixed.pose_ids.size(), 1u);
}

}  // namespace
}  // namespace sheaf
