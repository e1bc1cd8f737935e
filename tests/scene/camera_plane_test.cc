// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera_plane.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "geometry/lenses.h"
#include "io/models.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using Numbers = std::vector<std::uint64_t>;

/// One image at the origin of a world that it looks along, and points where they are said to be.
Problem seen_from_origin(CameraModel model, const std::vector<std::array<double, 3>>& points) {
  Problem problem;
  problem.add_image({}, test::ordinary(model));
  for (const auto& X : points)
    problem.add_observation(0, problem.add_point(X[0], X[1], X[2]), 100, 100);
  return problem;
}

TEST(CameraPlane, ListsWhatHasNoPixelForEveryModel) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    const auto model = static_cast<CameraModel>(m);
    const double ahead = model == CameraModel::bal ? -1 : 1;
    const PlaneSights found = plane_sights(seen_from_origin(
        model, {{0.1, 0.2, ahead}, {0, 0, 0}, {1, 2, 0}, {1, 2, -ahead}, {1e6, 0, 1e-3 * ahead}}));
    EXPECT_EQ(found.at_centre, (Numbers{1})) << to_string(model);
    const bool plane = model <= CameraModel::full_opencv || model == CameraModel::radial_k3;
    EXPECT_EQ(found.in_plane, plane ? (Numbers{2}) : Numbers()) << to_string(model);
  }
}

/// A lens of no distortion is of a plane, whatever its model.
TEST(CameraPlane, KnowsWhereAWideModelIsAPlanesOwn) {
  Problem fov = seen_from_origin(CameraModel::fov, {{1, 2, 0}});
  fov.cameras[0].parameters[4] = 0;
  EXPECT_EQ(plane_sights(fov).in_plane, (Numbers{0}));
  Problem eucm = seen_from_origin(CameraModel::eucm, {{1, 2, 0}});
  eucm.cameras[0].parameters[4] = 0;
  EXPECT_EQ(plane_sights(eucm).in_plane, (Numbers{0}));
  Problem division = seen_from_origin(CameraModel::simple_division, {{1, 2, 0}});
  EXPECT_EQ(plane_sights(division).in_plane, Numbers());
}

/// What is 0 is so up to the rounding of poses far from the origin, and no further.
TEST(CameraPlane, AllowsForRounding) {
  Problem problem = test::seen_by({test::ordinary(CameraModel::radial)}, 1, 1, 1);
  const Pose& pose = problem.poses[0];
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  const auto place = [&](std::array<double, 3> P) {
    for (std::size_t k = 0; k < 3; ++k) P[k] -= pose.translation[k];
    for (std::size_t k = 0; k < 3; ++k)
      problem.points[k] = R[k] * P[0] + R[3 + k] * P[1] + R[6 + k] * P[2];
  };
  place({0, 0, 0});
  EXPECT_EQ(plane_sights(problem).at_centre, (Numbers{0}));
  place({3, -2, 0});
  EXPECT_EQ(plane_sights(problem).in_plane, (Numbers{0}));
  place({3, -2, 1e-9});
  EXPECT_TRUE(plane_sights(problem).in_plane.empty());
  place({0, 0, 1e-9});
  EXPECT_TRUE(plane_sights(problem).at_centre.empty());
}

TEST(CameraPlane, FindsThoseOfFiles) {
  EXPECT_EQ(plane_sights(read("tests/data/z-zero.txt").value()).in_plane, (Numbers{176}));
  EXPECT_EQ(plane_sights(read("tests/data/point-at-centre.txt").value()).at_centre, (Numbers{15}));
  EXPECT_EQ(plane_sights(read("tests/data/point-at-origin.txt").value()).at_centre, (Numbers{0}));
}

}  // namespace
}  // namespace sheaf
