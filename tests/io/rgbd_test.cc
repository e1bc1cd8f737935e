// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "io/photometric_scenes.h"
#include "io/rgbd_folder.h"
#include "scene/depth_points.h"

namespace sheaf {
namespace {

using namespace test;

class Rgbd : public testing::Test {
 protected:
  const PhotometricSceneOptions scene_ = rgbd_scene();
  const PhotometricProblem truth_ = generate(scene_).value().truth;
  MemoryFolder folder_ = rgbd_folder(scene_, truth_);
  PhotometricReadOptions options_ = [] {
    PhotometricReadOptions o;
    o.depth_scale = kDepthScale, o.cell_px = 8;
    return o;
  }();
  Result<PhotometricFolder> read() const { return read_rgbd(files_of(folder_), options_); }
};

void expect_poses(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(a[i].translation[d], b[i].translation[d], 1e-12);
      EXPECT_NEAR(a[i].rotation[d + 1], b[i].rotation[d + 1], 1e-12);
    }
}

TEST_F(Rgbd, ListsByTimeArePutTogether) {
  const PhotometricFolder folder = read().value();
  EXPECT_EQ(folder.format, "rgbd");
  expect_poses(folder.problem.poses, truth_.poses);
  EXPECT_EQ(folder.times, (std::vector<double>{0.1, 0.2, 0.1 * 3, 0.4}));
  EXPECT_EQ(folder.problem.images[2].pixels, truth_.images[2].pixels);
  EXPECT_TRUE(folder.notes.empty());
  EXPECT_TRUE(validate(folder.problem).ok());
}

TEST_F(Rgbd, PointsLieOnTheSurfaceWhereItIsSteepest) {
  const PhotometricProblem problem = read().value().problem;
  ASSERT_GT(problem.num_points(), 300u);
  const WaveSurface surface(scene_, truth_.camera.fx, Random(scene_.seed, 0));
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    const Vector3<double> c = centre_of(problem.poses[problem.host[i]]);
    const double* X = &problem.points[3 * i];
    const double depth = depth_in(problem, i, problem.host[i]);
    const Vector3<double> ray{(X[0] - c[0]) / depth, (X[1] - c[1]) / depth, (X[2] - c[2]) / depth};
    EXPECT_NEAR(surface.hit(c, ray).depth, depth, 1e-4);
  }
  options_.max_points = 100;
  const PhotometricProblem fewer = read().value().problem;
  EXPECT_EQ(fewer.num_points(), 100u);
  options_.least_slope = 1e4;
  EXPECT_FALSE(read().ok());
}

TEST_F(Rgbd, HiddenPointsAreNotSeen) {
  const PhotometricProblem problem = read().value().problem;
  EXPECT_GT(problem.sight_point.size(), problem.num_points());
  // Image 1 is said to be half as deep: nothing is at its depth there.
  folder_["depth/1 a.png"] = [&] {
    Raster raster = decode_png(folder_["depth/1 a.png"], "x").value();
    for (std::uint16_t& sample : raster.samples) sample = static_cast<std::uint16_t>(sample / 2);
    return encode_png(raster).value();
  }();
  const PhotometricProblem hidden = read().value().problem;
  for (std::size_t k = 0; k < hidden.sight_point.size(); ++k) {
    EXPECT_NE(hidden.sight_image[k], 1u);
    EXPECT_NE(hidden.host[hidden.sight_point[k]], 1u);
  }
}

TEST_F(Rgbd, ImagesWithoutDepthAreLeftOutAndTold) {
  folder_["depth.txt"].replace(folder_["depth.txt"].find("0.21"), 4, "0.25");
  const PhotometricFolder folder = read().value();
  EXPECT_EQ(folder.problem.images.size(), 3u);
  ASSERT_EQ(folder.notes.size(), 1u);
  EXPECT_NE(folder.notes[0].find("1 images"), std::string::npos);
  options_.every = 2;
  EXPECT_EQ(read().value().problem.images.size(), 2u);
}

TEST_F(Rgbd, DisturbedPosesKeepTheirPointsAtTheirDepth) {
  const PhotometricProblem before = read().value().problem;
  options_.noise = {0.01, 0.02, 3};
  const PhotometricFolder folder = read().value();
  expect_poses(folder.given_poses, truth_.poses);
  for (std::size_t j = 0; j < 4; ++j) {
    const Vector3<double> a = centre_of(folder.problem.poses[j]), b = centre_of(truth_.poses[j]);
    EXPECT_NEAR(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 0.02, 1e-12);
    const auto &p = folder.problem.poses[j].rotation, &q = truth_.poses[j].rotation;
    const double cosine = std::abs(p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3]);
    EXPECT_NEAR(2 * std::acos(cosine), 0.01, 1e-6);
  }
  for (std::size_t i = 0; i < before.num_points(); ++i)
    EXPECT_NEAR(depth_in(folder.problem, i, before.host[i]), depth_in(before, i, before.host[i]),
                1e-12);
}

TEST_F(Rgbd, NumberedFoldersSayTheSame) {
  const PhotometricProblem timed = read().value().problem;
  folder_ = numbered_folder(scene_, truth_);
  const PhotometricFolder folder = read().value();
  EXPECT_EQ(folder.format, "rgbd-numbered");
  expect_poses(folder.problem.poses, truth_.poses);
  EXPECT_EQ(folder.problem.points, timed.points);
  EXPECT_EQ(folder.problem.sight_image, timed.sight_image);
}

/// As a PGM, and with 65535 where a camera saw nothing.
TEST_F(Rgbd, DepthMapsMayBePgmAndHave65535WhereThereIsNoDepth) {
  folder_ = numbered_folder(scene_, truth_);
  const PhotometricFolder png = read().value();
  const auto pgm_of = [](const Raster& raster, const std::string& comment) {
    std::string out = "P5\n" + comment + std::to_string(raster.width) + " " +
                      std::to_string(raster.height) + "\n65535\n";
    for (const std::uint16_t sample : raster.samples) {
      out += static_cast<char>(sample >> 8);
      out += static_cast<char>(sample & 255);
    }
    return out;
  };
  for (const char* number : {"1", "2", "3", "4"}) {
    const std::string name = std::string("depth/") + number;
    const Raster raster = decode_png(folder_.at(name + ".png"), name).value();
    folder_[name + ".pgm"] = pgm_of(raster, "# made by a test\n");
    folder_.erase(name + ".png");
  }
  const PhotometricFolder pgm = read().value();
  EXPECT_EQ(pgm.problem.points, png.problem.points);
  EXPECT_EQ(pgm.depth_files[0].extension(), ".pgm");
  const Raster nothing{160, 120, 1, 16, std::vector<std::uint16_t>(160 * 120, 65535)};
  folder_["depth/1.pgm"] = pgm_of(nothing, "");
  const PhotometricProblem without = read().value().problem;
  EXPECT_EQ(std::count(without.host.begin(), without.host.end(), 0u), 0);
  folder_["depth/1.pgm"].resize(1000);
  EXPECT_NE(std::string(read().error().what()).find("byte 1000: found the end of the file"),
            std::string::npos);
}

TEST_F(Rgbd, WhatIsBrokenIsSaid) {
  const MemoryFolder good = folder_;
  const auto refused = [&](const std::string& file, const std::string& bytes,
                           const std::string& words) {
    folder_ = good;
    folder_[file] = bytes;
    const auto result = read();
    ASSERT_FALSE(result.ok()) << words;
    const std::string message = result.error().what();
    EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input) << message;
    EXPECT_EQ(message.rfind("m", 0), 0u) << message;
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  const std::string depth = "depth/0 a.png", image = "rgb/0 a.png";
  refused("rgb.txt", "", "m/rgb.txt:0: found no file");
  refused("rgb.txt", "0.1\n", "expected the name of a file within the folder");
  refused("rgb.txt", "0.1 ../secret.png\n", "m/rgb.txt:1: found '../secret.png'");
  refused("rgb.txt", "nan rgb/0 a.png\n", "m/rgb.txt:1: found 'nan', expected a time");
  refused("rgb.txt", "7 rgb/0 a.png\n", "found 0 images with depth and pose");
  refused("rgb.txt", "0.1 rgb/9.png\n0.2 rgb/1 a.png\n", "m/rgb/9.png");
  refused("groundtruth.txt", "0.1 1 2 3 0 0 0\n", "m/groundtruth.txt:1: found the end of the line");
  refused("groundtruth.txt", "0.1 1 2 3 0 0 0 1e300\n", "unit quaternion");
  refused("groundtruth.txt", "0.1 1e999 2 3 0 0 0 1\n", "1e999");
  refused("groundtruth.txt", "0.1 1 2 3 0 0 0 1 4\n", "found more numbers");
  refused("groundtruth.txt", "# none\n", "found no pose");
  refused(depth, good.at(depth).substr(0, good.at(depth).size() / 2), "not a PNG");
  refused(image, good.at(image).substr(0, 40), "not a PNG");
  refused(depth, good.at(image), "found 1 channel of 8 bits, expected a depth map");
  const Raster small{20, 20, 1, 16, std::vector<std::uint16_t>(400, 1000)};
  refused(depth, encode_png(small).value(), "found 20 x 20 pixels, expected those of rgb/0 a.png");
  refused("hosts.txt", "0 1 1\n", "m/hosts.txt:1: found the end of the line");
  refused("hosts.txt", "4 1 1 1\n", "found '4', expected the host image of a point, 0 to 3");
  refused("hosts.txt", "0 1 1 0\n", "an inverse depth above 0");
  refused("hosts.txt", "# nothing\n", "found no point");
  refused("hosts.txt", "0 50 50 1e-200\n", "no point is seen by a second image");
  refused("intrinsics.txt", "1 2 3", "m/intrinsics.txt:1");
  refused("brightness.txt", "1 0\n", "m/brightness.txt");
}

TEST_F(Rgbd, WhatIsWrittenComesBack) {
  const auto path =
      std::filesystem::temp_directory_path() /
      ("sheaf-rgbd-" + std::to_string(testing::UnitTest::GetInstance()->random_seed()) + "-" +
       std::to_string(::getpid()));
  for (const MemoryFolder& made : {folder_, numbered_folder(scene_, truth_)}) {
    std::filesystem::remove_all(path);
    write_folder(made, path / "in");
    options_.noise = {0.001, 0.002, 1};
    options_.every = 2;
    PhotometricFolder folder = read_photometric(path / "in", options_).value();
    folder.problem.brightness = {{1, 0}, {0.9, -2.5}};
    ASSERT_TRUE(write_photometric(folder, path / "out").ok());
    PhotometricReadOptions again;
    again.depth_scale = kDepthScale;
    const PhotometricFolder back = read_photometric(path / "out", again).value();
    EXPECT_EQ(back.format, folder.format);
    if (folder.format == "rgbd") {
      EXPECT_EQ(back.times, folder.times);
    }
    expect_poses(back.problem.poses, folder.problem.poses);
    EXPECT_EQ(back.problem.host_xy, folder.problem.host_xy);
    EXPECT_EQ(back.problem.brightness[1].b, -2.5);
    ASSERT_EQ(back.problem.points.size(), folder.problem.points.size());
    for (std::size_t i = 0; i < back.problem.points.size(); ++i)
      EXPECT_NEAR(back.problem.points[i], folder.problem.points[i], 1e-9);
    EXPECT_EQ(back.problem.images[1].pixels, folder.problem.images[1].pixels);
  }
  std::filesystem::remove_all(path);
}

TEST(RgbdLists, NamesMayHaveBlanksAndLinesWindowsEnds) {
  const auto list = parse_file_list("# x\r\n1.5 a b.png\r\n\n2 c\n", "l").value();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].name, "a b.png");
  EXPECT_EQ(list[1].time, 2);
  for (const char* name : {"/etc/x", "a/../../x", "a/", ".."})
    EXPECT_FALSE(parse_file_list(std::string("1 ") + name, "l").ok()) << name;
}

}  // namespace
}  // namespace sheaf
