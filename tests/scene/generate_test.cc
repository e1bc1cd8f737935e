// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/problem.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

SceneOptions options_for(std::uint64_t images, std::uint64_t points, double mean_track) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  options.mean_track = mean_track;
  return options;
}

std::vector<std::uint64_t> histogram_of(const std::vector<std::uint32_t>& ids, std::size_t size) {
  std::vector<std::uint64_t> counts(size, 0);
  for (const std::uint32_t id : ids) ++counts.at(id);
  return counts;
}

// FNV-1a over the words that a file states. Quaternions are left out: they are what the machine's
// own sine makes of the angle-axis numbers.
struct Hash {
  std::uint64_t value = 0xcbf29ce484222325u;
  void add(std::uint64_t word) { value = (value ^ word) * 0x100000001b3u; }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
};

std::uint64_t hash_of(const Problem& problem) {
  Hash hash;
  for (const double x : problem.bal_angle_axis) hash.add(x);
  for (const Pose& pose : problem.poses)
    for (const double x : pose.translation) hash.add(x);
  for (const Camera& camera : problem.cameras)
    for (std::size_t k = 0; k < 3; ++k) hash.add(camera.parameters[k]);
  for (const double x : problem.points) hash.add(x);
  for (const double x : problem.observation_xy) hash.add(x);
  for (const std::uint32_t i : problem.observation_image) hash.add(std::uint64_t{i});
  for (const std::uint32_t i : problem.observation_point) hash.add(std::uint64_t{i});
  return hash.value;
}

TEST(Generate, HasTheSameBitsOnEveryMachine) {
  const Scene scene = generate(options_for(60, 2000, 3.5)).value();
  EXPECT_EQ(hash_of(scene.truth), 1389524725836530497u);
  EXPECT_EQ(hash_of(scene.start), 13619936912654561179u);
}

TEST(Generate, SeedsDiffer) {
  SceneOptions options = options_for(10, 200, 3);
  const std::uint64_t first = hash_of(generate(options).value().start);
  EXPECT_EQ(hash_of(generate(options).value().start), first);
  options.seed = 2;
  EXPECT_NE(hash_of(generate(options).value().start), first);
}

class GenerateShapes : public testing::TestWithParam<SceneOptions> {};

TEST_P(GenerateShapes, MeetsItsCounts) {
  const SceneOptions& options = GetParam();
  const Scene scene = generate(options).value();
  for (const Problem* problem : {&scene.start, &scene.truth}) {
    ASSERT_TRUE(validate(*problem).ok()) << validate(*problem).error().what();
    EXPECT_EQ(problem->num_images(), options.images);
    EXPECT_EQ(problem->cameras.size(), options.images);
    EXPECT_EQ(problem->num_points(), options.points);
  }
  const Problem& truth = scene.truth;
  const double mean = static_cast<double>(truth.num_observations()) / options.points;
  EXPECT_NEAR(mean, options.mean_track, 0.02 * options.mean_track);
  const auto tracks = histogram_of(truth.observation_point, truth.num_points());
  EXPECT_GE(*std::min_element(tracks.begin(), tracks.end()), 2u);
  const auto images = histogram_of(truth.observation_image, truth.num_images());
  if (truth.num_observations() >= 10 * options.images) {
    EXPECT_GE(*std::min_element(images.begin(), images.end()), 10u);
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t i = 0; i < truth.num_observations(); ++i)
    pairs.emplace(truth.observation_image[i], truth.observation_point[i]);
  EXPECT_EQ(pairs.size(), truth.num_observations()) << "an image observes a point twice";
}

TEST_P(GenerateShapes, TruthExplainsEveryPixelInFrontAndInTheFrame) {
  const Scene scene = generate(GetParam()).value();
  const Evaluation truth = evaluate(scene.truth);
  EXPECT_LT(truth.rms_px, 1e-7);
  EXPECT_TRUE(truth.behind.empty());
  EXPECT_TRUE(truth.not_finite.empty());
  for (std::size_t i = 0; i < scene.truth.num_observations(); ++i) {
    const auto image = scene.truth.observation_image[i];
    const auto& camera = scene.truth.cameras[scene.truth.image_camera[image]];
    EXPECT_GE(camera.parameters[0], 400);
    EXPECT_LE(camera.parameters[0], 1500);
    ASSERT_LT(std::fabs(scene.truth.observation_xy[2 * i]), 0.75 * camera.parameters[0]);
    ASSERT_LT(std::fabs(scene.truth.observation_xy[2 * i + 1]), 0.6 * camera.parameters[0]);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, GenerateShapes,
                         testing::Values(options_for(2, 1, 2), options_for(2, 100, 2),
                                         options_for(3, 40, 2.5), options_for(16, 4000, 4),
                                         options_for(16, 300, 16), options_for(50, 2000, 3),
                                         options_for(51, 2000, 3), options_for(400, 20000, 6),
                                         options_for(3000, 9000, 3.4)),
                         [](const auto& info) {
                           return std::to_string(info.param.images) + "Images" +
                                  std::to_string(info.param.points) + "Points";
                         });

TEST(Generate, TracksHaveAHeavyTail) {
  const Scene scene = generate(options_for(1000, 50000, 5)).value();
  auto tracks = histogram_of(scene.truth.observation_point, scene.truth.num_points());
  std::sort(tracks.begin(), tracks.end());
  EXPECT_LE(tracks[tracks.size() / 2], 3u);
  EXPECT_GE(tracks[tracks.size() - tracks.size() / 1000], 50u);
}

double deviation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

std::vector<double> centers(const Problem& problem) {
  std::vector<double> out;
  for (const Pose& pose : problem.poses) {
    const auto& q = pose.rotation;
    const auto R = matrix_from_quaternion<double>({q[0], -q[1], -q[2], -q[3]});
    for (const double x : multiply(R, pose.translation)) out.push_back(-x);
  }
  return out;
}

std::vector<double> turns(const Problem& a, const Problem& b) {
  std::vector<double> out;
  for (std::size_t j = 0; j < a.num_images(); ++j) {
    const auto& q = b.poses[j].rotation;
    const auto phi = angle_axis_from_quaternion(
        multiply(a.poses[j].rotation, Quaternion<double>{q[0], -q[1], -q[2], -q[3]}));
    out.insert(out.end(), phi.begin(), phi.end());
  }
  return out;
}

TEST(Generate, NoiseHasTheSizeAskedForAndEachKindItsOwnStream) {
  SceneOptions options = options_for(2000, 20000, 4);
  options.pixel_noise_px = 0.7;
  options.rotation_noise_rad = 0.01;
  options.center_noise = 0.03;
  options.point_noise = 0.04;
  options.focal_noise = 0.02;
  const Scene scene = generate(options).value();
  const auto& [start, truth] = scene;
  EXPECT_NEAR(deviation(start.observation_xy, truth.observation_xy), 0.7, 0.02);
  EXPECT_NEAR(deviation(start.points, truth.points), 0.04, 0.001);
  EXPECT_NEAR(deviation(centers(start), centers(truth)), 0.03, 0.001);
  const std::vector<double> phi = turns(start, truth);
  EXPECT_NEAR(deviation(phi, std::vector<double>(phi.size(), 0)), 0.01, 0.0003);
  std::vector<double> focal;
  for (std::size_t j = 0; j < start.cameras.size(); ++j) {
    focal.push_back(start.cameras[j].parameters[0] / truth.cameras[j].parameters[0] - 1);
    EXPECT_EQ(start.cameras[j].parameters[1], truth.cameras[j].parameters[1]);
    EXPECT_EQ(start.cameras[j].parameters[2], truth.cameras[j].parameters[2]);
  }
  EXPECT_NEAR(deviation(focal, std::vector<double>(focal.size(), 0)), 0.02, 0.001);

  options.rotation_noise_rad = 0;
  options.pixel_noise_px = 0;
  const Scene other = generate(options).value();
  EXPECT_EQ(other.start.points, start.points);
  EXPECT_EQ(other.start.observation_xy, truth.observation_xy);
  EXPECT_LT(deviation(turns(other.start, truth), std::vector<double>(phi.size(), 0)), 1e-12);
}

TEST(Generate, RotationsAreTheOnesTheirAngleAxisNumbersConvertTo) {
  const Scene scene = generate(options_for(20, 300, 4)).value();
  for (const Problem* problem : {&scene.start, &scene.truth}) {
    for (std::size_t j = 0; j < problem->num_images(); ++j) {
      const double* phi = &problem->bal_angle_axis[3 * j];
      EXPECT_EQ(problem->poses[j].rotation,
                quaternion_from_angle_axis<double>({phi[0], phi[1], phi[2]}));
    }
  }
}

TEST(Generate, RefusesWhatCannotBeMet) {
  const auto message = [](const SceneOptions& options) {
    const Result<Scene> result = generate(options);
    EXPECT_FALSE(result.ok());
    if (result.ok()) return std::string();
    EXPECT_EQ(result.error().code(), ErrorCode::usage);
    return std::string(result.error().what());
  };
  EXPECT_NE(message(options_for(1, 10, 2)).find("images"), std::string::npos);
  EXPECT_NE(message(options_for(4, 0, 2)).find("points"), std::string::npos);
  EXPECT_NE(message(options_for(4, 10, 1.9)).find("mean track"), std::string::npos);
  EXPECT_NE(message(options_for(4, 10, 4.1)).find("mean track"), std::string::npos);
  SceneOptions options = options_for(4, 10, 3);
  options.center_noise = -1;
  EXPECT_NE(message(options).find("center noise"), std::string::npos);
  options.center_noise = std::nan("");
  EXPECT_NE(message(options).find("center noise"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
