// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem some_scene(std::uint64_t images = 300, std::uint64_t points = 3000) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  return generate(options).value().truth;
}

Problem disturbed(const Problem& problem, const NoiseOptions& options) {
  Problem out = problem;
  EXPECT_TRUE(perturb(out, options).ok());
  return out;
}

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

Vector3<double> center_of(const Pose& pose) {
  const Vector3<double> c =
      multiply(matrix_from_quaternion(conjugate(pose.rotation)), pose.translation);
  return {-c[0], -c[1], -c[2]};
}

// phi of R_after = exp(phi) R_before.
Vector3<double> turn_between(const Pose& before, const Pose& after) {
  return angle_axis_from_quaternion(multiply(after.rotation, conjugate(before.rotation)));
}

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Draws of a normal distribution: mean 0 and this deviation, each within 4.5 of its own sigmas.
void expect_normal(const std::vector<double>& draws, double sigma) {
  const double n = static_cast<double>(draws.size());
  double sum = 0, squares = 0;
  for (const double x : draws) sum += x, squares += x * x;
  EXPECT_NEAR(sum / n, 0, 4.5 * sigma / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(squares / n), sigma, 4.5 * sigma / std::sqrt(2 * n));
}

TEST(Perturb, SigmasAreThoseOfTheComponents) {
  const Problem before = some_scene();
  NoiseOptions options;
  options.rotation_rad = 0.01;
  options.center = 0.03;
  options.point = 0.07;
  options.pixel_px = 1.5;
  options.intrinsics = {20, 0.001, 0};
  options.intrinsics_relative = {0, 0, 0.25};
  const Problem after = disturbed(before, options);
  std::vector<double> turns, centers, points, pixels, f, k1, k2;
  for (std::size_t j = 0; j < before.num_images(); ++j) {
    const Vector3<double> a = center_of(before.poses[j]), b = center_of(after.poses[j]);
    const Vector3<double> phi = turn_between(before.poses[j], after.poses[j]);
    for (std::size_t k = 0; k < 3; ++k) {
      turns.push_back(phi[k]);
      centers.push_back(b[k] - a[k]);
    }
    const auto &x = before.cameras[j].parameters, &y = after.cameras[j].parameters;
    f.push_back(y[0] - x[0]);
    k1.push_back(y[1] - x[1]);
    k2.push_back((y[2] - x[2]) / std::fabs(x[2]));
  }
  for (std::size_t i = 0; i < before.points.size(); ++i)
    points.push_back(after.points[i] - before.points[i]);
  for (std::size_t i = 0; i < before.observation_xy.size(); ++i)
    pixels.push_back(after.observation_xy[i] - before.observation_xy[i]);
  expect_normal(turns, 0.01);
  expect_normal(centers, 0.03);
  expect_normal(points, 0.07);
  expect_normal(pixels, 1.5);
  expect_normal(f, 20);
  expect_normal(k1, 0.001);
  expect_normal(k2, 0.25);
}

TEST(Perturb, NoKindOfNoiseChangesAnother) {
  const Problem before = some_scene(20, 500);
  const std::vector<std::function<void(NoiseOptions&)>> kinds = {[](NoiseOptions& o) { o.rotation_rad = 0.02; },
                                                                 [](NoiseOptions& o) { o.translation = 0.1; },
                                                                 [](NoiseOptions& o) { o.point = 0.1; },
                                                                 [](NoiseOptions& o) { o.intrinsics = {10, 0, 0}; },
                                                                 [](NoiseOptions& o) { o.pixel_px = 2; },
                                                                 [](NoiseOptions& o) { o.outliers = 0.2; }};
  NoiseOptions everything;
  for (const auto& kind : kinds) kind(everything);
  const Problem all = disturbed(before, everything);
  const auto alone = [&](int kind) {
    NoiseOptions options;
    kinds[kind](options);
    return disturbed(before, options);
  };
  const Problem turned = alone(0), shifted = alone(1);
  EXPECT_EQ(turned.bal_angle_axis, all.bal_angle_axis);
  for (std::size_t j = 0; j < before.num_images(); ++j)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(all.poses[j].translation[k] - turned.poses[j].translation[k],
                  shifted.poses[j].translation[k] - before.poses[j].translation[k], 1e-12);
  EXPECT_EQ(alone(2).points, all.points);
  const Problem lenses = alone(3);
  for (std::size_t c = 0; c < before.cameras.size(); ++c)
    EXPECT_EQ(lenses.cameras[c].parameters, all.cameras[c].parameters);
  const Problem pixels = alone(4), outliers = alone(5);
  for (std::size_t i = 0; i < before.observation_xy.size(); ++i)
    EXPECT_NEAR(all.observation_xy[i] - pixels.observation_xy[i],
                outliers.observation_xy[i] - before.observation_xy[i], 1e-9);
  EXPECT_EQ(shifted.bal_angle_axis, before.bal_angle_axis);
  EXPECT_EQ(shifted.points, before.points);
  EXPECT_EQ(pixels.points, before.points);
}

TEST(Perturb, TwiceTheSigmaIsTwiceTheError) {
  const Problem before = some_scene(20, 500);
  NoiseOptions one, two;
  one.point = 0.25;
  two.point = 0.5;
  const Problem a = disturbed(before, one), b = disturbed(before, two);
  for (std::size_t i = 0; i < before.points.size(); ++i)
    EXPECT_NEAR(b.points[i] - before.points[i], 2 * (a.points[i] - before.points[i]), 1e-12);
}

TEST(Perturb, ProtocolsHoldWhatTheySay) {
  const Problem before = some_scene(30, 300);
  NoiseOptions options;
  options.rotation_rad = 0.05;
  const Problem sheaf = disturbed(before, options);
  options.protocol = NoiseProtocol::rootba;
  const Problem rootba = disturbed(before, options);
  options.protocol = NoiseProtocol::ceres;
  const Problem ceres = disturbed(before, options);
  for (std::size_t j = 0; j < before.num_images(); ++j) {
    const Pose& pose = before.poses[j];
    EXPECT_LT(distance(center_of(sheaf.poses[j]), center_of(pose)), 1e-12);
    EXPECT_LT(distance(center_of(ceres.poses[j]), center_of(pose)), 1e-12);
    EXPECT_EQ(rootba.poses[j].translation, pose.translation);
    const Vector3<double> phi = turn_between(pose, sheaf.poses[j]);
    EXPECT_LT(distance(turn_between(pose, rootba.poses[j]), phi), 1e-14);
    // Ceres adds the same numbers to the angle-axis vector itself.
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(ceres.bal_angle_axis[3 * j + k] - before.bal_angle_axis[3 * j + k], phi[k],
                  1e-12);
  }
}

TEST(Perturb, OutliersAreExactlyAsManyAndAsFar) {
  const Problem before = some_scene(30, 2000);
  NoiseOptions options;
  options.outliers = 0.1;
  options.outlier_px = 50;
  Problem after = before;
  const NoiseRecord record = perturb(after, options).value();
  const std::size_t n = before.num_observations();
  EXPECT_EQ(record.outliers.size(), static_cast<std::size_t>(std::floor(0.1 * n + 0.5)));
  EXPECT_TRUE(std::is_sorted(record.outliers.begin(), record.outliers.end()));
  double sum_x = 0, sum_y = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = after.observation_xy[2 * i] - before.observation_xy[2 * i];
    const double y = after.observation_xy[2 * i + 1] - before.observation_xy[2 * i + 1];
    const bool moved = next < record.outliers.size() && record.outliers[next] == i;
    if (moved) ++next;
    EXPECT_NEAR(std::hypot(x, y), moved ? 50 : 0, 1e-9);
    sum_x += x, sum_y += y;
  }
  // Directions are even: each sum has the variance 50^2 / 2 for each outlier.
  const double sigma = 50 * std::sqrt(record.outliers.size() / 2.0);
  EXPECT_LT(std::fabs(sum_x), 4.5 * sigma);
  EXPECT_LT(std::fabs(sum_y), 4.5 * sigma);

  options.outliers = 0.3;
  Problem more = before;
  const NoiseRecord larger = perturb(more, options).value();
  EXPECT_TRUE(std::includes(larger.outliers.begin(), larger.outliers.end(), record.outliers.begin(),
                            record.outliers.end()));
  for (const std::uint64_t i : record.outliers)
    EXPECT_EQ(more.observation_xy[2 * i], after.observation_xy[2 * i]);
  options.outliers = 1;
  EXPECT_EQ(perturb(more, options).value().outliers.size(), n);
}

TEST(Perturb, HasTheSameBitsEverywhere) {
  SceneOptions scene;
  scene.points = 200;
  Problem problem = generate(scene).value().start;
  NoiseOptions options = published_noise(NoiseProtocol::rootba);
  options.rotation_rad = 0.02;
  options.pixel_px = 0.5;
  options.outliers = 0.05;
  options.intrinsics_relative = {0.01, 0.02, 0.03};
  options.least_depth = 0;
  ASSERT_TRUE(perturb(problem, options).ok());
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&](double x) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x100000001b3u;
  };
  for (const double x : problem.bal_angle_axis) add(x);
  for (const Pose& pose : problem.poses)
    for (const double x : pose.translation) add(x);
  for (const Camera& camera : problem.cameras)
    for (std::size_t k = 0; k < 3; ++k) add(camera.parameters[k]);
  for (const double x : problem.points) add(x);
  for (const double x : problem.observation_xy) add(x);
  EXPECT_EQ(hash, 9256378538503064154u);
}

TEST(Perturb, TakesProblemsFromArraysAndSharedLenses) {
  Problem problem = some_scene(10, 200);
  problem.bal_angle_axis.clear();
  problem.cameras.resize(1);
  std::fill(problem.image_camera.begin(), problem.image_camera.end(), 0);
  NoiseOptions options;
  options.rotation_rad = 0.1;
  const Problem after = disturbed(problem, options);
  EXPECT_TRUE(validate(after).ok());
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    EXPECT_LT(distance(center_of(after.poses[j]), center_of(problem.poses[j])), 1e-12);
    EXPECT_GT(distance(turn_between(problem.poses[j], after.poses[j]), {}), 1e-4);
  }
}

TEST(Perturb, LeavesOutWhatIsNearOrBehind) {
  // Image 0 at the origin, image 1 at z = 30, both look along -z.
  Problem problem;
  problem.add_image({}, Camera{CameraModel::bal, {500, 0, 0}});
  problem.add_image({{1, 0, 0, 0}, {0, 0, -30}}, Camera{CameraModel::bal, {500, 0, 0}});
  problem.add_point(0, 0, -10);    // 10 and 40 in front
  problem.add_point(1, 1, 20);     // behind image 0
  problem.add_point(0, 0, -0.05);  // too near to image 0
  problem.add_point(2, 0, -5);     // 5 and 35 in front
  for (std::uint32_t p = 0; p < 4; ++p)
    for (std::uint32_t j = 0; j < 2; ++j) problem.add_observation(j, p, p, j);
  NoiseOptions options;
  options.least_depth = 0.1;
  const NoiseRecord record = perturb(problem, options).value();
  EXPECT_EQ(record.dropped_observations, 4u);
  EXPECT_EQ(record.dropped_points, 2u);
  EXPECT_EQ(problem.points, (std::vector<double>{0, 0, -10, 2, 0, -5}));
  EXPECT_EQ(problem.observation_point, (std::vector<std::uint32_t>{0, 0, 1, 1}));
  EXPECT_EQ(problem.observation_image, (std::vector<std::uint32_t>{0, 1, 0, 1}));
  EXPECT_EQ(problem.observation_xy, (std::vector<double>{0, 0, 0, 1, 3, 0, 3, 1}));
}

TEST(Perturb, RefusesWhatMakesNoSenseAndChangesNothing) {
  const Problem before = some_scene(10, 100);
  const std::vector<std::function<void(NoiseOptions&)>> wrong = {
      [](NoiseOptions& o) { o.point = -1; },
      [](NoiseOptions& o) { o.pixel_px = std::numeric_limits<double>::quiet_NaN(); },
      [](NoiseOptions& o) { o.rotation_rad = std::numeric_limits<double>::infinity(); },
      [](NoiseOptions& o) { o.outliers = 1.1; },
      [](NoiseOptions& o) { o.intrinsics[1] = -1e-9; },
      [](NoiseOptions& o) { o.protocol = NoiseProtocol::ceres, o.center = 0.1; },
      [](NoiseOptions& o) { o.protocol = NoiseProtocol::rootba, o.translation = 0.1; }};
  for (const auto& make : wrong) {
    NoiseOptions options;
    options.normalize_to = 100;
    make(options);
    Problem problem = before;
    const auto result = perturb(problem, options);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code(), ErrorCode::usage);
    EXPECT_EQ(problem.points, before.points);
  }
}

TEST(Normalize, PutsTheMedianAtZeroAndKeepsProjections) {
  Problem problem = some_scene(10, 501);
  for (Pose& pose : problem.poses)  // a scene far from the origin
    for (double& x : pose.translation) x *= 3;
  for (double& x : problem.points) x *= 3;
  const Evaluation before = evaluate(problem);
  const Normalization made = normalize(problem, 100).value();
  const Evaluation after = evaluate(problem);
  EXPECT_NEAR(after.rms_px, before.rms_px, 1e-9);
  EXPECT_NE(made.scale, 1);
  std::vector<double> sizes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (std::size_t i = 0; i < problem.num_points(); ++i)
      values.push_back(problem.points[3 * i + k]);
    std::sort(values.begin(), values.end());
    EXPECT_EQ(values[values.size() / 2], 0);
  }
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    sizes.push_back(std::fabs(problem.points[3 * i]) + std::fabs(problem.points[3 * i + 1]) +
                    std::fabs(problem.points[3 * i + 2]));
  std::sort(sizes.begin(), sizes.end());
  EXPECT_NEAR(sizes[sizes.size() / 2], 100, 1e-10);
}

TEST(Normalize, RefusesPointsInOnePlace) {
  Problem problem;
  problem.add_image({}, Camera{});
  for (int i = 0; i < 3; ++i) problem.add_point(1, 2, 3);
  EXPECT_EQ(normalize(problem).error().code(), ErrorCode::usage);
  EXPECT_EQ(normalize(problem, -1).error().code(), ErrorCode::usage);
  Problem empty;
  EXPECT_FALSE(normalize(empty).ok());
}

}  // namespace
}  // namespace sheaf
