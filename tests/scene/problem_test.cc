// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/problem.h"

#include <gtest/gtest.h>

#include <string>

namespace sheaf {
namespace {

Problem three_images() {
  Problem problem;
  problem.add_image({}, {CameraModel::bal, {500, 0, 0}});
  problem.add_image({}, 0);
  problem.add_image({}, 0);
  problem.add_point(0, 0, -5);
  problem.add_observation(0, 0, 3, 4);
  return problem;
}

std::string wrong_with(const Problem& problem) {
  const Result<void> valid = validate(problem);
  return valid.ok() ? "" : valid.error().what();
}

TEST(ValidProblem, IndicesOutOfRangeAreSaidWithTheirRange) {
  EXPECT_EQ(wrong_with(three_images()), "");
  Problem image = three_images(), point = three_images(), camera = three_images();
  image.observation_image[0] = 99;
  EXPECT_EQ(wrong_with(image), "observation 0: found 99, expected an image below 3");
  point.observation_point[0] = 1;
  EXPECT_EQ(wrong_with(point), "observation 0: found 1, expected a point below 1");
  camera.image_camera[2] = 7;
  EXPECT_EQ(wrong_with(camera), "image 2: found 7, expected a camera below 1");
}

}  // namespace
}  // namespace sheaf
