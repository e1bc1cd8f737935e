// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/model_images.h"

#include <gtest/gtest.h>

#include "io/photometric_scenes.h"

namespace sheaf {
namespace {

using namespace test;

class ModelImages : public testing::Test {
 protected:
  const PhotometricProblem scene_ = generate(rgbd_scene()).value().truth;
  MemoryFolder pictures_ = pictures_of(scene_);
  Problem model_ = model_of(scene_);

  Result<PhotometricFolder> made() const {
    PhotometricFolder folder;
    folder.model = model_;
    if (auto added = add_images(files_of(pictures_), folder); !added.ok()) return added.error();
    return folder;
  }
};

TEST_F(ModelImages, PixelsCountFromTheFirstOnesCentre) {
  const PhotometricFolder folder = made().value();
  const PhotometricProblem& problem = folder.problem;
  EXPECT_NEAR(problem.camera.cx, scene_.camera.cx, 1e-12);
  EXPECT_EQ(problem.images[3].pixels, scene_.images[3].pixels);
  ASSERT_TRUE(validate(problem).ok());
  ASSERT_GT(problem.num_points(), 80u);
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    for (std::size_t o = 0; o < model_.num_observations(); ++o) {
      if (model_.observation_point[o] == folder.model_point[i] &&
          model_.observation_image[o] == problem.host[i]) {
        for (std::size_t d = 0; d < 2; ++d)
          EXPECT_NEAR(problem.host_xy[2 * i + d] + 0.5, model_.observation_xy[2 * o + d], 1e-9);
      }
    }
}

TEST_F(ModelImages, SightsAreTheTracks) {
  const PhotometricFolder folder = made().value();
  std::size_t in_tracks = 0;
  for (const std::uint32_t point : folder.model_point)
    in_tracks += static_cast<std::size_t>(
        std::count(model_.observation_point.begin(), model_.observation_point.end(), point));
  EXPECT_EQ(folder.problem.sight_point.size(), in_tracks - folder.model_point.size());
}

TEST_F(ModelImages, HostsSeeFromTheMiddle) {
  // One point straight below the second of three cameras in a row; the fourth stands far away.
  PhotometricProblem row = scene_;
  for (std::size_t j = 0; j < row.poses.size(); ++j) {
    row.poses[j].rotation = {1, 0, 0, 0};
    row.poses[j].translation = {-0.5 * (double(j) - 1), 0, j < 3 ? 4.0 : 12.0};
  }
  row.points = {0, 0, 0};
  model_ = model_of(row);
  EXPECT_EQ(made().value().problem.host, (std::vector<std::uint32_t>{1}));
}

TEST_F(ModelImages, TheStateGoesBackToItsPoints) {
  model_.add_point(1, 2, 3);  // nobody sees it
  PhotometricFolder folder = made().value();
  ASSERT_EQ(folder.notes.size(), 1u);
  EXPECT_EQ(folder.notes[0].rfind("1 points", 0), 0u) << folder.notes[0];
  folder.problem.poses[2].translation[1] += 0.25;
  folder.problem.points[0] += 0.5;
  const Problem out = model_with_state(folder);
  EXPECT_EQ(out.poses[2].translation[1], model_.poses[2].translation[1] + 0.25);
  EXPECT_EQ(out.points[3 * folder.model_point[0]], model_.points[3 * folder.model_point[0]] + 0.5);
  EXPECT_EQ(out.points[3 * (out.num_points() - 1)], 1);
  EXPECT_EQ(out.observation_xy, model_.observation_xy);
}

TEST_F(ModelImages, OtherLensesAndSizesAreRefused) {
  const Problem good = model_;
  const auto refused = [&](ErrorCode code, const std::string& words) {
    const auto result = made();
    ASSERT_FALSE(result.ok()) << words;
    EXPECT_EQ(result.error().code(), code);
    EXPECT_NE(std::string(result.error().what()).find(words), std::string::npos)
        << result.error().what();
  };
  model_.cameras[0].model = CameraModel::simple_radial;
  refused(ErrorCode::usage, "of/0.png has a SIMPLE_RADIAL lens");
  refused(ErrorCode::usage, "undistort");
  model_ = good;
  model_.cameras.push_back(model_.cameras[0]);
  model_.cameras[1].parameters[0] += 1;
  model_.image_camera[2] = 1;
  refused(ErrorCode::usage, "of/2.png has other intrinsics than of/0.png");
  model_ = good;
  model_.cameras[0].width_px = 161;
  refused(ErrorCode::unreadable_input,
          "m/of/0.png: found 160 x 120 pixels, expected its camera's 161");
  model_ = good;
  pictures_.erase("of/1.png");
  refused(ErrorCode::unreadable_input, "of/1.png");
  pictures_["of/1.png"] = pictures_["of/0.png"].substr(0, 99);
  refused(ErrorCode::unreadable_input, "m/of/1.png: not a PNG");
}

}  // namespace
}  // namespace sheaf
