// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/lakeside.h"

#include <algorithm>
#include <cmath>

#include "platform/portable_math.h"
#include "platform/random.h"
#include "scene/portable_rotation.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kFewestForRing = 51;  // a ring of fewer images would be narrower than kArc
constexpr double kArcRadius = 8;
constexpr double kEyeHeight = 1.6;
constexpr double kFrameX = 0.7;  // half the frame at unit depth: a 70 degree lens, format 4:3
constexpr double kFrameY = 0.525;
constexpr double kAimX = 0.5;  // where points are aimed at, so that jitter keeps them in the frame
constexpr double kAimY = 0.35;
constexpr double kFrontLength = 6;

Lakeside::Station make_station(double angle, double radius, Random& random) {
  const double yaw = angle + 3.14159265358979323846 + random.uniform(-0.08, 0.08);
  const SineCosine across = portable_sine_cosine(angle);
  const SineCosine y = portable_sine_cosine(yaw);
  const SineCosine p = portable_sine_cosine(random.uniform(-0.04, 0.06));
  const SineCosine r = portable_sine_cosine(random.uniform(-0.03, 0.03));
  const double distance = radius + random.uniform(-0.3, 0.3);
  const std::array<double, 3> center = {distance * across.cosine, distance * across.sine,
                                        kEyeHeight + random.uniform(-0.3, 0.3)};
  // Rows: right, up, back.
  const std::array<double, 3> right = {y.sine, -y.cosine, 0};
  const std::array<double, 3> up = {-p.sine * y.cosine, -p.sine * y.sine, p.cosine};
  std::array<double, 9> upright;
  for (int k = 0; k < 3; ++k) {
    upright[k] = r.cosine * right[k] + r.sine * up[k];
    upright[3 + k] = r.cosine * up[k] - r.sine * right[k];
  }
  upright[6] = -p.cosine * y.cosine;
  upright[7] = -p.cosine * y.sine;
  upright[8] = -p.sine;

  Lakeside::Station station;
  station.angle_axis = portable_angle_axis(portable_quaternion(upright));
  station.rotation = portable_matrix(portable_quaternion(station.angle_axis));
  for (int k = 0; k < 3; ++k) {
    const double* row = &station.rotation[3 * k];
    station.translation[k] = -(row[0] * center[0] + row[1] * center[1] + row[2] * center[2]);
  }
  const double u = random.uniform();
  station.intrinsics = {400 + 1100 * u * u, random.uniform(-0.08, 0.02), random.uniform(0, 0.03)};
  return station;
}

}  // namespace

Lakeside::Lakeside(std::uint32_t images, std::uint64_t seed)
    : seed_(seed),
      radius_(images < kFewestForRing ? kArcRadius : images / (2 * 3.14159265358979323846)),
      closed_(images >= kFewestForRing) {
  Random random(seed, 1);
  stations_.reserve(images);
  for (std::uint32_t i = 0; i < images; ++i)
    stations_.push_back(make_station(angle_of(i), radius_, random));
}

double Lakeside::front_depth(double position) const {
  const auto front = static_cast<std::uint64_t>(static_cast<std::int64_t>(position / kFrontLength));
  Random random(seed_, 1000 + front);
  return 4.5 + 6 * random.uniform();
}

std::array<double, 3> Lakeside::point_before(std::uint32_t first, std::uint32_t count, int attempt,
                                             Random& random) const {
  const double middle = first + (count - 1) / 2.0;
  const double half_span = std::min(angle_of(count / 2.0), 1.1071487177940904);  // atan 2
  // An image at the angle a from the point has it at tan = q sin a / (radius - q cos a), where q is
  // the point's distance from the centre; this is below kAimX up to a = half_span for q <=
  // farthest. The worst a is atan(1 / kAimX) = atan 2 or the end of the span.
  const SineCosine sc = portable_sine_cosine(half_span);
  const double nearest = radius_ * (1 - kAimX / (sc.sine + kAimX * sc.cosine));
  const double position = middle + random.uniform(-0.3, 0.3);
  const double front = front_depth(position);
  const double choice = random.uniform();
  double depth, height;
  if (attempt < 4 && nearest < front && choice < 0.75) {
    depth = front + random.uniform(-0.1, 0.1);
    height = random.uniform(0, kEyeHeight + kAimY * front);
  } else if (attempt < 4 && nearest < front) {
    depth = random.uniform(std::max(nearest, 4.0), 1.5 * front);
    height = random.uniform(0, 0.05);
  } else {
    depth = std::max(nearest, 4.0) * random.uniform(1, 1.5);
    height = random.uniform(0.4, kEyeHeight + (attempt < 4 ? kAimY : 0.1) * depth);
  }
  // Not all far points may sit on the lake's axis.
  depth = std::min(depth, std::max(nearest, radius_ * random.uniform(0.6, 0.95)));
  const SineCosine at = portable_sine_cosine(angle_of(position));
  return {(radius_ - depth) * at.cosine, (radius_ - depth) * at.sine, height};
}

std::array<double, 3> Lakeside::in_camera(std::uint32_t image,
                                          const std::array<double, 3>& point) const {
  const Station& station = stations_[image];
  std::array<double, 3> out;
  for (int k = 0; k < 3; ++k) {
    const double* row = &station.rotation[3 * k];
    out[k] = row[0] * point[0] + row[1] * point[1] + row[2] * point[2] + station.translation[k];
  }
  return out;
}

bool Lakeside::sees(std::uint32_t image, const std::array<double, 3>& point) const {
  const std::array<double, 3> P = in_camera(image, point);
  const double depth = -P[2];
  return depth > 0.5 && std::fabs(P[0]) < kFrameX * depth && std::fabs(P[1]) < kFrameY * depth;
}

std::array<double, 2> Lakeside::project(std::uint32_t image,
                                        const std::array<double, 3>& point) const {
  const std::array<double, 3> P = in_camera(image, point);
  const auto& [f, k1, k2] = stations_[image].intrinsics;
  const double x = -P[0] / P[2];
  const double y = -P[1] / P[2];
  const double n = x * x + y * y;
  const double scale = f * (1 + n * (k1 + n * k2));
  return {scale * x, scale * y};
}

}  // namespace sheaf
