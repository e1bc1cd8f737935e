// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_course.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/camera_model.h"
#include "geometry/lenses.h"

namespace sheaf {
namespace {

constexpr double kPi = std::numbers::pi;

std::array<double, 2> offset_at(double px, double angle) {
  return {px * std::cos(angle), px * std::sin(angle)};
}

bool is_fisheye(CameraModel model) {
  return (model >= CameraModel::opencv_fisheye && model <= CameraModel::thin_prism_fisheye) ||
         model == CameraModel::rad_tan_thin_prism_fisheye || model == CameraModel::simple_fisheye ||
         model == CameraModel::fisheye;
}

bool is_division(CameraModel model) {
  return model == CameraModel::simple_division || model == CameraModel::division;
}

TEST(LensCourse, OrdinaryLensesAreSoundAllRound) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    const Camera camera = test::ordinary(static_cast<CameraModel>(m));
    for (int k = 0; k < 12; ++k)
      for (const double px : {1e-6, 1.0, 100.0, 400.0})
        EXPECT_EQ(course_of(camera, offset_at(px, k * kPi / 6)), LensCourse::sound)
            << to_string(camera.model) << " " << k << " " << px;
    EXPECT_FALSE(absurd_distortion(camera, {300, 0}));
    EXPECT_FALSE(absurd_distortion(camera, {0, 0}));
    EXPECT_FALSE(outside_model(camera));
    EXPECT_EQ(course_of(camera, {0, 0}), LensCourse::sound);
  }
}

/// r (1 + k r^2) has its maximum at r^2 = -1 / (3 k), where it is 2/3 r. An edge counts from nine
/// tenths of its distance on.
TEST(LensCourse, FoldsWhereTheFormulaDoes) {
  for (const double k : {-0.3, -0.9}) {
    const double radius = 500 * 2 / 3.0 * std::sqrt(-1 / (3 * k));
    for (const Camera& camera : {Camera{CameraModel::simple_radial, {500, 320, 240, k}},
                                 Camera{CameraModel::simple_radial_fisheye, {500, 320, 240, k}},
                                 Camera{CameraModel::bal, {500, k, 0}}}) {
      EXPECT_EQ(course_of(camera, offset_at(0.995 * radius / 0.9, 1)), LensCourse::sound);
      EXPECT_EQ(course_of(camera, offset_at(1.001 * radius / 0.9, 1)), LensCourse::folds);
    }
  }
}

/// Each model that can fold does so for a first coefficient of this size.
TEST(LensCourse, FoldsForEveryModelWithACoefficient) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    Camera camera = test::ordinary(static_cast<CameraModel>(m));
    const ParameterRoles roles = roles_of(camera.model);
    if (roles.k1 < 0 || is_division(camera.model)) continue;
    const double f = camera.parameters[0], edge = 0.3;
    for (std::size_t i = 0; i < parameter_count(camera.model); ++i)
      if (int(i) != roles.fx && int(i) != roles.fy && int(i) != roles.cx && int(i) != roles.cy)
        camera.parameters[i] = 0;
    double& k1 = camera.parameters[static_cast<std::size_t>(roles.k1)];
    const std::array<double, 2> at = {edge * f, 0};
    k1 = -0.5 / (edge * edge);
    EXPECT_EQ(course_of(camera, at), LensCourse::folds) << to_string(camera.model);
    EXPECT_FALSE(absurd_distortion(camera, at)) << to_string(camera.model);
    for (const double k : {-0.95 / (edge * edge), 9.5 / (edge * edge), 1e300, -1e300}) {
      k1 = k;
      EXPECT_TRUE(absurd_distortion(camera, at)) << to_string(camera.model) << " " << k;
    }
    k1 = 8 / (edge * edge);
    EXPECT_EQ(course_of(camera, at), LensCourse::sound) << to_string(camera.model);
    EXPECT_FALSE(absurd_distortion(camera, at)) << to_string(camera.model);
  }
}

/// A quotient that has a pole, and one that does not get far enough out.
TEST(LensCourse, FollowsAQuotient) {
  Camera camera{CameraModel::full_opencv, {500, 500, 320, 240}};
  camera.parameters[9] = -4;  // the pole is at r = 1/2, and pixels go out to infinity before it
  EXPECT_EQ(course_of(camera, {200, 0}), LensCourse::sound);
  camera.parameters[9] = 2;  // r / (1 + 2 r^2) has its maximum 0.354 at r = 0.707
  EXPECT_EQ(course_of(camera, {175 / 0.9, 0}), LensCourse::sound);
  EXPECT_EQ(course_of(camera, {178 / 0.9, 0}), LensCourse::folds);
}

TEST(LensCourse, EndsWhereNoRayGoesFartherOut) {
  const Camera fov{CameraModel::fov, {300, 300, 320, 240, 3}};
  EXPECT_EQ(course_of(fov, {300 / 0.9, 0}), LensCourse::sound);  // pi / 3 f is the farthest
  EXPECT_EQ(course_of(fov, {320 / 0.9, 0}), LensCourse::ends);
  const Camera eucm{CameraModel::eucm, {300, 300, 320, 240, 0.9, 1}};
  EXPECT_EQ(course_of(eucm, {330 / 0.9, 0}), LensCourse::sound);  // f / sqrt(0.8) is the farthest
  EXPECT_EQ(course_of(eucm, {340 / 0.9, 0}), LensCourse::ends);
  EXPECT_FALSE(absurd_distortion(eucm, {340 / 0.9, 0}));
  const Camera ucm{CameraModel::ucm, {300, 300, 320, 240, 0.9}};
  EXPECT_EQ(course_of(ucm, {330 / 0.9, 0}), LensCourse::sound);
  EXPECT_EQ(course_of(ucm, {340 / 0.9, 0}), LensCourse::ends);
  // Pixels of a division lens end at f / sqrt(k), where Z = 2 sqrt(k) r.
  const Camera division{CameraModel::division, {300, 300, 320, 240, 0.25}};
  EXPECT_EQ(course_of(division, {590 / 0.9, 0}), LensCourse::sound);
  EXPECT_EQ(course_of(division, {610 / 0.9, 0}), LensCourse::ends);
  EXPECT_TRUE(absurd_distortion({CameraModel::eucm, {300, 300, 320, 240, 0.9, 1e9}}, {300, 0}));
}

/// alpha = 0 and omega = 0 are pinholes, whose pixels go out for ever.
TEST(LensCourse, NearlyFlatWideModelsReachFar) {
  for (const Camera& camera : {Camera{CameraModel::eucm, {300, 300, 320, 240, 0, 1}},
                               Camera{CameraModel::eucm, {300, 300, 320, 240, 0.3, 1}},
                               Camera{CameraModel::ucm, {300, 300, 320, 240, 0.3}},
                               Camera{CameraModel::double_sphere, {300, 300, 320, 240, 0, 0}},
                               Camera{CameraModel::simple_division, {300, 320, 240, 0}},
                               Camera{CameraModel::fov, {300, 300, 320, 240, 0}},
                               Camera{CameraModel::fov, {300, 300, 320, 240, 0.01}}})
    for (const double px : {30, 300, 1500})
      EXPECT_EQ(course_of(camera, {px, 0}), LensCourse::sound) << camera.parameters[4] << " " << px;
}

TEST(LensCourse, ParametersOutsideTheModel) {
  EXPECT_TRUE(outside_model({CameraModel::fov, {300, 300, 320, 240, 3.2}}));
  EXPECT_TRUE(outside_model({CameraModel::eucm, {300, 300, 320, 240, 1.1, 1}}));
  EXPECT_TRUE(outside_model({CameraModel::eucm, {300, 300, 320, 240, -0.1, 1}}));
  EXPECT_TRUE(outside_model({CameraModel::eucm, {300, 300, 320, 240, 0.5, 0}}));
  EXPECT_TRUE(outside_model({CameraModel::ucm, {300, 300, 320, 240, 1.1}}));
  EXPECT_TRUE(outside_model({CameraModel::double_sphere, {300, 300, 320, 240, 1, 0.5}}));
  EXPECT_TRUE(outside_model({CameraModel::double_sphere, {300, 300, 320, 240, 0.2, -0.1}}));
  EXPECT_TRUE(outside_model({CameraModel::equirectangular, {640, 0}}));
}

TEST(LensCourse, FocalLengthsByTheAnglesThatTheyMean) {
  const auto deg = [](double angle) { return angle * kPi / 180; };
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    Camera camera = test::ordinary(static_cast<CameraModel>(m));
    const ParameterRoles roles = roles_of(camera.model);
    if (roles.fx < 0) {
      EXPECT_FALSE(absurd_focal(camera, 320));
      continue;
    }
    const bool two = roles.fy != roles.fx;
    const auto absurd = [&](double f) {
      camera.parameters[0] = f;
      if (two) camera.parameters[1] = f;
      return absurd_focal(camera, 320);
    };
    EXPECT_TRUE(absurd(0) && absurd(-500)) << to_string(camera.model);
    EXPECT_TRUE(absurd(320 / std::tan(deg(0.24)))) << to_string(camera.model);
    EXPECT_FALSE(absurd(320 / std::tan(deg(0.26)))) << to_string(camera.model);
    const double least = is_fisheye(camera.model) ? 320 / kPi : 320 / std::tan(deg(87.5));
    EXPECT_TRUE(absurd(0.99 * least)) << to_string(camera.model);
    EXPECT_FALSE(absurd(1.01 * least)) << to_string(camera.model);
    EXPECT_FALSE(absurd_focal(camera, 0)) << "nothing tells how large the image is";
    if (two) {
      camera.parameters[0] = 500, camera.parameters[1] = -500;
      EXPECT_TRUE(absurd_focal(camera, 320));
    }
  }
}

}  // namespace
}  // namespace sheaf
