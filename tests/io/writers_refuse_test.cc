// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "sheaf/problem.h"

// What a reader would refuse is refused by its writer, found by fuzz/writers_fuzz.cc.
namespace sheaf {
namespace {

Problem one_point(const Camera& camera) {
  Problem problem;
  problem.cameras.push_back(camera);
  problem.add_image({}, std::uint32_t(0));
  problem.add_image({}, std::uint32_t(0));
  problem.poses[1].translation = {1, 0, 0};
  problem.add_point(0, 0, 5);
  problem.add_observation(0, 0, 320, 240);
  problem.add_observation(1, 0, 400, 240);
  return problem;
}
Camera pinhole(double fx, double fy) {
  Camera camera;
  camera.model = CameraModel::pinhole;
  camera.parameters = {fx, fy, 320, 240};
  camera.width_px = 640, camera.height_px = 480;
  return camera;
}

void expect_refused(const Problem& problem, const std::string& format, const std::string& name,
                    const std::string& words) {
  const TemporaryFolder folder;
  const Result<void> done = write(problem, folder / name, {.format = format});
  ASSERT_FALSE(done.ok()) << format;
  EXPECT_EQ(done.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(done.error().what()).find(words), std::string::npos) << done.error().what();
  EXPECT_TRUE(folder.names().empty()) << format;
}

TEST(Writers, RefuseCentresBeyondTheRangeOfNumbers) {
  Problem problem = one_point(pinhole(500, 500));
  problem.poses[1].translation = {1.5e308, 1.5e308, 1.5e308};
  const double half = std::acos(-1.0) / 8;  // an eighth of a turn sums parts of two axes
  problem.poses[1].rotation = {std::cos(half), 0, 0, std::sin(half)};
  for (const auto& [format, name] :
       {std::pair{"nvm", "m.nvm"}, std::pair{"openmvg", "sfm_data.json"},
        std::pair{"alicevision", "m.sfm"}, std::pair{"nerfstudio", "transforms.json"}})
    expect_refused(problem, format, name, "the centre of image 1 is beyond the range of numbers");
}

TEST(Writers, RefuseFocalLengthsThatAreNotAboveZero) {
  for (const auto& [fx, fy] : {std::pair{-500.0, 500.0}, std::pair{500.0, -500.0},
                               std::pair{0.0, 500.0}, std::pair{500.0, 0.0}}) {
    const Problem problem = one_point(pinhole(fx, fy));
    expect_refused(problem, "alicevision", "m.sfm", "focal length");
    expect_refused(problem, "opensfm", "reconstruction.json", "focal length");
  }
  Camera fisheye = pinhole(-300, 300);
  fisheye.model = CameraModel::opencv_fisheye;
  expect_refused(one_point(fisheye), "opensfm", "reconstruction.json", "focal length");
  expect_refused(one_point(fisheye), "alicevision", "m.sfm", "focal length");
}

/// Whose square is beyond the range of numbers, where no coefficient asks for it.
TEST(Writers, NvmReadsTheFarthestMeasurementAgain) {
  Problem problem = one_point(pinhole(500, 500));
  problem.observation_xy[0] = -1.5e308;
  const TemporaryFolder folder;
  ASSERT_TRUE(write(problem, folder / "m.nvm").ok());
  const Result<Problem> again = read(folder / "m.nvm");
  ASSERT_TRUE(again.ok()) << again.error().what();
  EXPECT_DOUBLE_EQ(again.value().observation_xy[0], -1.5e308);
}

}  // namespace
}  // namespace sheaf
