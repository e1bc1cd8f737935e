// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "starts/bearing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/camera_model.h"
#include "geometry/lenses.h"
#include "solve/lens_problems.h"

namespace sheaf::test {
namespace {

TEST(Bearing, UndoesEveryModelsProjection) {
  for (CameraModel model : all_models()) {
    const Camera camera = ordinary(model);
    const double forward = model == CameraModel::bal ? -1 : 1;
    for (double x : {-0.4, -0.1, 0.0, 0.25})
      for (double y : {-0.3, 0.0, 0.35}) {
        const double length = std::sqrt(x * x + y * y + 1);
        const Vector3<double> d = {x / length, y / length, forward / length};
        const auto found = bearing(camera, project(camera, d).pixel.data());
        ASSERT_TRUE(found.has_value()) << to_string(model) << " " << x << " " << y;
        for (std::size_t k = 0; k < 3; ++k)
          EXPECT_NEAR((*found)[k], d[k], 1e-9) << to_string(model);
      }
  }
}

TEST(Bearing, IsNoneWhereNoDirectionHasThePixel) {
  Camera camera;
  camera.model = CameraModel::simple_radial;
  camera.parameters = {500, 320, 240, -0.5};  // r (1 - r^2 / 2) is at most 0.544
  const double far[2] = {320 + 0.8 * 500, 240};
  EXPECT_FALSE(bearing(camera, far).has_value());
  camera.parameters[0] = 0;
  EXPECT_FALSE(bearing(camera, far).has_value());
}

TEST(Bearing, OfAPanoramaIsInAnyDirection) {
  const Camera panorama = ordinary(CameraModel::equirectangular);
  for (const Vector3<double>& P :
       {Vector3<double>{0, 0, -1}, {0.6, 0, -0.8}, {-0.6, 0.64, -0.48}, {0, 1, 0}}) {
    const auto found = bearing(panorama, project(panorama, P).pixel.data());
    ASSERT_TRUE(found.has_value());
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR((*found)[k], P[k], 1e-15);
  }
  const double over_the_pole[2] = {100, 480.5};
  EXPECT_FALSE(bearing(panorama, over_the_pole).has_value());
}

TEST(Bearing, WithoutDistortionEveryModelIsNearlyThePinholeOrEquidistant) {
  for (CameraModel model : all_models()) {
    if (model == CameraModel::equirectangular) continue;  // it has no axis
    const Camera plain = without_distortion(ordinary(model));
    const double forward = model == CameraModel::bal ? -1 : 1;
    const auto centre = project(plain, {0, 0, forward}).pixel;
    const auto roles = roles_of(model);
    const auto off = project(plain, {0.01, 0, forward}).pixel;
    EXPECT_NEAR(off[0] - centre[0], 0.01 * plain.parameters[static_cast<std::size_t>(roles.fx)],
                1e-2)
        << to_string(model);
  }
}

}  // namespace
}  // namespace sheaf::test
