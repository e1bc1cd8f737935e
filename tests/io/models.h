// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"
#include "io/colmap.h"
#include "sheaf/problem.h"

namespace sheaf::test {

/// Bytes as a COLMAP binary file has them, put together by this test alone.
class Bytes {
 public:
  template <class T>
  Bytes& add(T value) {
    const auto* raw = reinterpret_cast<const char*>(&value);
    out_.append(raw, sizeof value);  // the machines that run tests are little-endian
    return *this;
  }
  Bytes& text(const std::string& s) { return out_ += s + '\0', *this; }
  std::string take() { return out_; }

 private:
  std::string out_;
};

inline constexpr std::uint64_t kNone = ~std::uint64_t{0};

/// Two cameras, three images (ids out of order, one without features), two points and features that
/// observe nothing: 3 observations. Colours, errors and names are all different.
inline ColmapFiles tiny_binary() {
  ColmapFiles f;
  f.folder = "m/";
  f.cameras = Bytes()
                  .add<std::uint64_t>(2)
                  .add<std::uint32_t>(7)
                  .add<std::int32_t>(2)  // SIMPLE_RADIAL
                  .add<std::uint64_t>(640)
                  .add<std::uint64_t>(480)
                  .add(500.0)
                  .add(320.0)
                  .add(240.0)
                  .add(-0.01)
                  .add<std::uint32_t>(3)
                  .add<std::int32_t>(4)  // OPENCV
                  .add<std::uint64_t>(1920)
                  .add<std::uint64_t>(1080)
                  .add(900.0)
                  .add(901.0)
                  .add(960.0)
                  .add(540.0)
                  .add(0.01)
                  .add(-0.002)
                  .add(0.0003)
                  .add(-0.0004)
                  .take();
  Bytes images;
  images.add<std::uint64_t>(3);
  const auto pose = [&](std::uint32_t id, double x, std::uint32_t camera, const std::string& name) {
    images.add(id).add(0.8).add(0.6).add(0.0).add(0.0).add(x).add(0.25).add(5.0).add(camera).text(
        name);
  };
  pose(12, 0.5, 7, "left image.png");
  images.add<std::uint64_t>(3)
      .add(300.5)
      .add(200.25)
      .add<std::uint64_t>(41)
      .add(10.0)
      .add(20.0)
      .add<std::uint64_t>(kNone)
      .add(310.5)
      .add(210.25)
      .add<std::uint64_t>(5);
  pose(4, -0.5, 3, "b.png");
  images.add<std::uint64_t>(2)
      .add(1.5)
      .add(2.5)
      .add<std::uint64_t>(kNone)
      .add(900.5)
      .add(500.25)
      .add<std::uint64_t>(41);
  pose(9, 1.5, 3, "sub/c.png");
  images.add<std::uint64_t>(0);
  f.images = images.take();
  Bytes points;
  points.add<std::uint64_t>(2);
  const auto point = [&](std::uint64_t id, double x, std::uint8_t red, double error) {
    points.add(id).add(x).add(0.5).add(-0.25);
    points.add<std::uint8_t>(red).add<std::uint8_t>(20).add<std::uint8_t>(255).add(error);
  };
  point(41, 0.125, 10, 1.75);
  points.add<std::uint64_t>(2)
      .add<std::uint32_t>(4)
      .add<std::uint32_t>(1)
      .add<std::uint32_t>(12)
      .add<std::uint32_t>(0);
  point(5, -0.125, 11, 0.5);
  points.add<std::uint64_t>(1).add<std::uint32_t>(12).add<std::uint32_t>(2);
  f.points = points.take();
  return f;
}

/// The same scene as text, as a person may have written it: comments, signs, trailing zeros.
inline ColmapFiles tiny_text() {
  ColmapFiles f;
  f.text = true;
  f.folder = "m/";
  f.cameras =
      "# made by hand\n7 SIMPLE_RADIAL 640 480 500.0 320 240 -1e-2\n\n"
      "3 OPENCV 1920 1080 900 901 960 540 0.01 -0.002 0.0003 -0.0004\n";
  f.images =
      "# a comment\n"
      "12 0.80 0.60 0 0 0.5 0.25 5.0 7 left image.png\n"
      "300.5 200.25 41 10 20 -1 310.50 210.25 5\n"
      "4 0.8 0.6 0 0 -.5 0.25 5 3 b.png\n"
      "1.5 2.5 -1   900.5 500.25 41\n"
      "9 0.8 0.6 0 0 1.5 0.25 5 3 sub/c.png\n"
      "\n";
  f.points =
      "# another\n41 0.125 0.5 -0.250 10 20 255 1.75 4 1 12 0\n5 -0.125 .5 -0.25 11 20 255 0.5 12 "
      "2\n"
      "# the end\n";
  return f;
}

inline std::string rigs_binary() {
  Bytes out;
  out.add<std::uint64_t>(2);
  for (std::uint32_t camera : {7u, 3u})
    out.add<std::uint32_t>(camera).add<std::uint32_t>(1).add<std::int32_t>(0).add(camera);
  return out.take();
}

/// One frame for each image of tiny_binary, with the image's pose.
inline std::string frames_binary() {
  Bytes out;
  out.add<std::uint64_t>(3);
  const auto frame = [&](std::uint32_t id, std::uint32_t camera, double x) {
    out.add<std::uint32_t>(id).add(camera).add(0.8).add(0.6).add(0.0).add(0.0).add(x).add(0.25).add(
        5.0);
    out.add<std::uint32_t>(1).add<std::int32_t>(0).add(camera).add<std::uint64_t>(id);
  };
  frame(4, 3, -0.5), frame(9, 3, 1.5), frame(12, 7, 0.5);
  return out.take();
}

inline std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

/// Poses, lenses, points and measurements, bit for bit.
inline bool same_state(const Problem& a, const Problem& b) {
  return state_hash(a) == state_hash(b);
}

/// A scene that cameras of any models see, their parameters given: images on an arc, exact pixels.
inline Problem seen_by(const std::vector<Camera>& lenses, std::size_t images, std::size_t points,
                       unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  Problem problem;
  problem.cameras = lenses;
  for (std::size_t i = 0; i < points; ++i) problem.add_point(u(random), u(random), u(random));
  for (std::size_t j = 0; j < images; ++j) {
    const double angle =
        1.2 * static_cast<double>(j) / static_cast<double>(images) + 0.01 * u(random);
    Pose pose;
    pose.rotation = quaternion_from_angle_axis<double>({0.05 * u(random), angle, 0.05 * u(random)});
    const bool back = lenses[j % lenses.size()].model == CameraModel::bal;
    pose.translation = {0.1 * u(random), 0.1 * u(random), back ? -5.0 : 5.0};
    const auto lens = static_cast<std::uint32_t>(j % lenses.size());
    const std::uint32_t image = problem.add_image(pose, lens);
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    for (std::uint32_t i = 0; i < points; ++i) {
      Vector3<double> P =
          multiply(R, Vector3<double>{problem.points[3 * i], problem.points[3 * i + 1],
                                      problem.points[3 * i + 2]});
      for (std::size_t k = 0; k < 3; ++k) P[k] += pose.translation[k];
      const auto pixel = project(lenses[lens], P).pixel;
      problem.add_observation(image, i, pixel[0], pixel[1]);
    }
  }
  return problem;
}

}  // namespace sheaf::test
