// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_reach.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "geometry/lenses.h"
#include "io/models.h"

namespace sheaf {
namespace {

using Numbers = std::vector<std::uint64_t>;

Problem scene(CameraModel model, bool sized) {
  Camera camera = test::ordinary(model);
  if (sized) camera.width_px = 640, camera.height_px = 480;
  return test::seen_by({camera}, 2, 30, 4);
}

TEST(LensReach, KeepsTheFarthestOfEachSector) {
  LensReach reach;
  reach.add({3, 1}), reach.add({6, 1}), reach.add({-2, -1}), reach.add({0, 0});
  EXPECT_DOUBLE_EQ(reach.farthest(), std::hypot(6, 1));
  int filled = 0;
  for (const auto& offset : reach.offsets) filled += offset[0] != 0;
  EXPECT_EQ(filled, 2);
}

TEST(LensReach, SectorsAreEighthsOfATurn) {
  const auto by_angle = [](double x, double y) {
    const double turn = std::atan2(y, x) / (2 * std::numbers::pi) + 0.5;
    return static_cast<std::size_t>(turn * LensReach::kSectors) % LensReach::kSectors;
  };
  for (int k = 0; k < 720; ++k) {
    const double angle = (k + 0.3) * std::numbers::pi / 360;
    const double x = 7 * std::cos(angle), y = 7 * std::sin(angle);
    EXPECT_EQ(LensReach::sector_of({x, y}), by_angle(x, y)) << k;
  }
  for (const double x : {-2.0, 0.0, 2.0})
    for (const double y : {-2.0, 0.0, 2.0})
      EXPECT_EQ(LensReach::sector_of({x, y}), by_angle(x, y)) << x << ' ' << y;
}

TEST(LensReach, CornersAreWhereThePixelsSaySo) {
  EXPECT_EQ(reach_of_corners(test::ordinary(CameraModel::radial)).farthest(), 0);
  Camera camera{CameraModel::radial, {500, 300, 240}, 640, 480};
  EXPECT_DOUBLE_EQ(reach_of_corners(camera).farthest(), std::hypot(340, 240));
  const Camera bal{CameraModel::bal, {500}, 640, 480};
  EXPECT_DOUBLE_EQ(reach_of_corners(bal).farthest(), 400);
}

TEST(LensReach, NothingIsAbsurdInOrdinaryScenes) {
  for (std::size_t m = 0; m < kCameraModels; ++m)
    for (const bool sized : {false, true}) {
      const Problem problem = scene(static_cast<CameraModel>(m), sized);
      const MeasuredReaches found = measured_reaches(problem);
      EXPECT_TRUE(found.absurd.empty());
      EXPECT_GT(found.reaches[0].farthest(), 30);
    }
}

/// Where the size is known, from 1.5 sizes from the middle on; else by the median.
TEST(LensReach, FindsAbsurdMeasurements) {
  for (std::size_t m = 0; m < kCameraModels; ++m)
    for (const bool sized : {false, true}) {
      Problem problem = scene(static_cast<CameraModel>(m), sized);
      const double reach = measured_reaches(problem).reaches[0].farthest();
      problem.observation_xy[2 * 7] = 1e100;
      problem.observation_xy[2 * 9 + 1] = -1e9;
      const MeasuredReaches found = measured_reaches(problem);
      EXPECT_EQ(found.absurd, (Numbers{7, 9}));
      EXPECT_LE(found.reaches[0].farthest(), reach);
    }
}

TEST(LensReach, HoldsMeasurementsAgainstTheImage) {
  Problem problem = scene(CameraModel::pinhole, true);
  const auto absurd = [&](double x, double y) {
    problem.observation_xy[0] = x, problem.observation_xy[1] = y;
    return !measured_reaches(problem).absurd.empty();
  };
  EXPECT_FALSE(absurd(-639, 100) || absurd(1279, 100) || absurd(10, -479) || absurd(10, 959));
  EXPECT_TRUE(absurd(-641, 100) && absurd(1281, 100) && absurd(10, -481) && absurd(10, 961));
}

/// A wrong match of ten times the median is none that no image can hold, and says nothing of the
/// lens either.
TEST(LensReach, LeavesWrongMatchesOutOfTheReach) {
  Problem problem = scene(CameraModel::bal, false);
  const double reach = measured_reaches(problem).reaches[0].farthest();
  problem.observation_xy[6] = 20 * reach;
  EXPECT_TRUE(measured_reaches(problem).absurd.empty());
  EXPECT_LE(measured_reaches(problem).reaches[0].farthest(), reach);
}

/// A lens of few observations is held against all.
TEST(LensReach, TakesTheMedianOfAllForFew) {
  Problem problem = scene(CameraModel::bal, false);
  const std::uint32_t image = problem.add_image(problem.poses[0], problem.cameras[0]);
  for (const double x : {1e-3, 2e-3, 150.0}) problem.add_observation(image, 0, x, 0);
  EXPECT_TRUE(measured_reaches(problem).absurd.empty());
}

}  // namespace
}  // namespace sheaf
