// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/bal.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "geometry/rotation.h"
#include "io/bytes.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

void expect_same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_EQ(bits(a[i]), bits(b[i])) << "entry " << i;
}

void expect_same(const Problem& a, const Problem& b) {
  EXPECT_EQ(a.image_camera, b.image_camera);
  EXPECT_EQ(a.observation_image, b.observation_image);
  EXPECT_EQ(a.observation_point, b.observation_point);
  expect_same_bits(a.observation_xy, b.observation_xy);
  expect_same_bits(a.points, b.points);
  expect_same_bits(a.bal_angle_axis, b.bal_angle_axis);
  ASSERT_EQ(a.num_images(), b.num_images());
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t i = 0; i < a.num_images(); ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      ASSERT_EQ(bits(a.poses[i].rotation[k]), bits(b.poses[i].rotation[k]));
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_EQ(bits(a.poses[i].translation[k]), bits(b.poses[i].translation[k]));
      ASSERT_EQ(bits(a.cameras[i].parameters[k]), bits(b.cameras[i].parameters[k]));
    }
  }
}

/// All numbers of a text, by the C library.
std::vector<double> numbers(const std::string& text) {
  std::vector<double> all;
  const char* p = text.c_str();
  for (char* end;; p = end) {
    const double value = std::strtod(p, &end);
    if (end == p) return all;
    all.push_back(value);
  }
}

/// The numbers of a problem in a BAL file's order.
std::vector<double> flatten(const Problem& p) {
  std::vector<double> all{double(p.num_images()), double(p.num_points()),
                          double(p.num_observations())};
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    all.insert(all.end(), {double(p.observation_image[i]), double(p.observation_point[i]),
                           p.observation_xy[2 * i], p.observation_xy[2 * i + 1]});
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    const auto& t = p.poses[i].translation;
    const auto& c = p.cameras[p.image_camera[i]].parameters;
    const double* a = &p.bal_angle_axis[3 * i];
    all.insert(all.end(), {a[0], a[1], a[2], t[0], t[1], t[2], c[0], c[1], c[2]});
  }
  all.insert(all.end(), p.points.begin(), p.points.end());
  return all;
}

/// Doubles that are hard to read or write, then random bit patterns.
std::vector<double> awkward_doubles(std::size_t count) {
  using Limits = std::numeric_limits<double>;
  std::vector<double> all{0.0,
                          -0.0,
                          Limits::denorm_min(),
                          -Limits::denorm_min(),
                          Limits::min(),
                          Limits::max(),
                          -Limits::max(),
                          Limits::lowest(),
                          0.1,
                          1.0 / 3,
                          2.2250738585072011e-308,
                          9007199254740993.0,
                          1e22,
                          1e23,
                          5e-324,
                          123456789012345680.0};
  std::mt19937_64 random(7);
  while (all.size() < count)
    if (const double x = std::bit_cast<double>(random()); std::isfinite(x)) all.push_back(x);
  return all;
}

Problem awkward_problem() {
  const std::vector<double> values = awkward_doubles(3000);
  Problem p;
  for (std::size_t i = 0; i < 40; ++i) {
    // Rotation vectors of every size: none, tiny, ordinary, beyond pi.
    const double size = i == 0 ? 0 : std::pow(10, double(i) / 4 - 8);
    const Vector3<double> a{-0.6 * size, 0.0 * size, i % 2 ? 0.8 * size : -0.8 * size};
    p.bal_angle_axis.insert(p.bal_angle_axis.end(), a.begin(), a.end());
    p.add_image({quaternion_from_angle_axis(a), {values[i], values[2 * i], values[i + 9]}},
                {CameraModel::bal, {values[3 * i], values[i + 1], values[i + 100]}});
  }
  for (std::size_t i = 0; i < 300; ++i) p.add_point(values[i], values[i + 300], values[i + 600]);
  for (std::uint32_t i = 0; i < 1000; ++i)
    p.add_observation(i % 40, i * 7 % 300, values[i + 1000], values[i + 2000]);
  return p;
}

TEST(Bal, RoundTripsEveryBit) {
  const test::Folder folder;
  const Problem problem = awkward_problem();
  for (const char* name : {"plain.txt", "small.txt.gz", "small.txt.bz2"}) {
    ASSERT_TRUE(write(problem, folder / name).ok());
    const Result<InputFile> file = read_file(folder / name);
    ASSERT_TRUE(file.ok()) << file.error().what();
    expect_same(problem, file.value().problem);
  }
  EXPECT_EQ(folder.files(), 3u);
  // And what was written is what the C library reads.
  expect_same_bits(numbers(test::slurp(folder / "plain.txt")), flatten(problem));
}

TEST(Bal, ReadsEverySpellingOfNumbersAndSpace) {
  const std::string text =
      "\t1 1\r\n1\r\n0 00 +5.0e+01 -.5E-0\v\f0. 0 -0.0\n1e-400 5e-324 1.\n"
      "+123 000000000000000000000000000000001 1e+0000 0x"
      "\n";
  std::string good = text;
  good.replace(good.find("0x"), 2, "-1e-5 6 .7E2");  // no end of line is missing here
  for (std::string variant : {good, good.substr(0, good.size() - 1), good + "  \n\r\n"}) {
    const Result<Problem> result = parse_bal(variant, "spelling", 40);
    ASSERT_TRUE(result.ok()) << result.error().what();
    expect_same_bits(flatten(result.value()),
                     {1, 1, 1, 0, 0, 50, -.5, 0, 0, -0.0, 0, 5e-324, 1, 123, 1, 1, -1e-5, 6, 70});
  }
}

TEST(Bal, WritesTheStatedRotationOnlyWhileItHolds) {
  const test::Folder folder;
  Problem problem = awkward_problem();
  const std::vector<double> stated = problem.bal_angle_axis;
  const Vector3<double> moved{0.3, -0.2, 0.1};
  problem.poses[5].rotation = quaternion_from_angle_axis(moved);
  ASSERT_TRUE(write(problem, folder / "moved.txt").ok());
  const Problem back = read(folder / "moved.txt").value();
  for (std::size_t i = 0; i < stated.size(); ++i) {
    if (i / 3 == 5) {
      EXPECT_NEAR(back.bal_angle_axis[i], moved[i - 15], 1e-15);
    } else {
      ASSERT_EQ(bits(back.bal_angle_axis[i]), bits(stated[i]));
    }
  }
}

TEST(Bal, RepeatsSharedLensesAndConvertsUnstatedRotations) {
  const test::Folder folder;
  Problem problem;
  const std::uint32_t first =
      problem.add_image({{0.8, 0.6, 0, 0}, {1, 2, 3}}, Camera{CameraModel::bal, {700, -0.1, 0.02}});
  problem.add_image({{1, 0, 0, 0}, {4, 5, 6}}, problem.image_camera[first]);
  problem.add_point(1, 2, -9);
  problem.add_observation(0, 0, 1, 2);
  problem.add_observation(1, 0, 3, 4);
  ASSERT_TRUE(write(problem, folder / "shared.txt").ok());
  const Problem back = read(folder / "shared.txt").value();
  ASSERT_EQ(back.cameras.size(), 2u);
  EXPECT_EQ(back.cameras[1].parameters, problem.cameras[0].parameters);
  EXPECT_NEAR(back.bal_angle_axis[0], 2 * std::atan2(0.6, 0.8), 1e-15);
  EXPECT_EQ(back.bal_angle_axis[3], 0);
}

TEST(Bal, RefusesToWriteWhatItCouldNotRead) {
  const test::Folder folder;
  Problem problem;
  EXPECT_EQ(write(problem, folder / "none.txt").error().code(), ErrorCode::usage);
  problem = awkward_problem();
  problem.points[7] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(write(problem, folder / "nan.txt").error().code(), ErrorCode::usage);
  EXPECT_EQ(folder.files(), 0u);
}

TEST(Bal, RealFilesMatchTheCLibraryAndRoundTrip) {
  const std::filesystem::path data = test::bal_data();
  if (data.empty()) GTEST_SKIP() << "no real scenes: set SHEAF_DATA";
  const test::Folder folder;
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data)) {
    if (entry.path().extension() != ".txt") continue;
    SCOPED_TRACE(entry.path().string());
    const std::vector<double> expected = numbers(test::slurp(entry.path()));
    const Result<InputFile> file = read_file(entry.path());
    if (!file.ok()) {
      // A scene whose header disagrees with its content: the counts must show it too.
      const double needed = 3 + 4 * expected[2] + 9 * expected[0] + 3 * expected[1];
      EXPECT_NE(double(expected.size()), needed) << file.error().what();
      continue;
    }
    expect_same_bits(flatten(file.value().problem), expected);
    EXPECT_EQ(file.value().bytes, std::filesystem::file_size(entry.path()));
    ASSERT_TRUE(write(file.value().problem, folder / "again.txt").ok());
    expect_same(read(folder / "again.txt").value(), file.value().problem);
    expect_same_bits(numbers(test::slurp(folder / "again.txt")), expected);
    ++scenes;
  }
  EXPECT_GE(scenes, 1);
}

}  // namespace
}  // namespace sheaf
