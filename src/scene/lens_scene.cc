// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/lens_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "platform/random.h"
#include "scene/portable_pose.h"
#include "scene/scene_lenses.h"

namespace sheaf {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kOrbitRadius = 4, kWideFromDeg = 120;

enum Stream : std::uint64_t { kPlaces = 2 };

Vector3<double> in_camera(const Matrix3<double>& R, const Vector3<double>& t,
                          const Vector3<double>& X) {
  Vector3<double> P = multiply(R, X);
  for (std::size_t i = 0; i < 3; ++i) P[i] += t[i];
  return P;
}

}  // namespace

LensScene::LensScene(const LensSceneOptions& options)
    : images_(static_cast<std::uint32_t>(options.scene.images)) {
  const double view = field_of_view_deg(options).value();
  half_view_rad_ = view / 2 * kDegree;
  cosine_ = portable_sine_cosine(half_view_rad_).cosine;
  wide_ = view >= kWideFromDeg;
  const std::uint64_t count =
      options.lenses == 0 ? images_ : std::min<std::uint64_t>(options.lenses, images_);
  lenses_ = draw_lenses(options.model, half_view_rad_, count, options.scene.seed);
  Random random(options.scene.seed, kPlaces);
  wide_ ? place_below(random) : place_around(random);
  for (const Pose& pose : poses_) rotations_.push_back(portable_matrix(pose.rotation));
}

/// On a wavy ring around the scene, looking at it.
void LensScene::place_around(Random& random) {
  const SineCosine view = portable_sine_cosine(half_view_rad_);
  const double aside = std::min(0.4, 0.45 * view.sine / view.cosine);
  for (std::uint32_t j = 0; j < images_; ++j) {
    const SineCosine at = portable_sine_cosine(2 * std::numbers::pi * j / images_);
    const SineCosine wave = portable_sine_cosine(10 * std::numbers::pi * j / images_);
    const double radius = kOrbitRadius + random.uniform(-0.4, 0.4);
    const Vector3<double> centre{radius * at.cosine, radius * at.sine,
                                 wave.sine + random.uniform(-0.2, 0.2)};
    Vector3<double> ahead;
    for (double& x : ahead) x = random.uniform(-aside, aside);
    for (std::size_t i = 0; i < 3; ++i) ahead[i] -= centre[i];
    const double roll = (j % 4 == 3 ? std::numbers::pi / 2 : 0) + random.uniform(-0.2, 0.2);
    poses_.push_back(pose_at(looking(ahead, roll), centre));
  }
}

/// On a ring in the middle of the scene, looking up.
void LensScene::place_below(Random& random) {
  for (std::uint32_t j = 0; j < images_; ++j) {
    const SineCosine at = portable_sine_cosine(2 * std::numbers::pi * j / images_);
    const double radius = 1.2 + random.uniform(-0.3, 0.3);
    const Vector3<double> centre{radius * at.cosine, radius * at.sine, random.uniform(-0.4, 0.4)};
    const Vector3<double> ahead{random.uniform(-0.25, 0.25), random.uniform(-0.25, 0.25), 1};
    poses_.push_back(pose_at(looking(ahead, random.uniform(-3, 3)), centre));
  }
}

std::array<double, 3> LensScene::point(Random& random) const {
  // A direction, uniform over the sphere.
  double x, y, s;
  do {
    x = random.uniform(-1, 1), y = random.uniform(-1, 1), s = x * x + y * y;
  } while (s >= 1);
  const double root = 2 * std::sqrt(1 - s);
  const std::array<double, 3> d{root * x, root * y, 1 - 2 * s};
  if (!wide_) {
    const SineCosine view = portable_sine_cosine(0.8 * half_view_rad_);
    const double most = std::min(2.5, kOrbitRadius * view.sine / view.cosine);
    const double r = most * std::sqrt(random.uniform());
    return {r * d[0], r * d[1], r * d[2]};
  }
  // Half of them low, where a wide lens ends.
  const double r = random.uniform(2.5, 6);
  const bool low = random.below(2) == 0;
  const double z = low ? cosine_ + (d[2] + 1) / 2 * 0.35 : d[2];
  const double flat = std::sqrt(d[0] * d[0] + d[1] * d[1]) + 1e-12;
  const double scale = std::sqrt(std::max(0.0, 1 - z * z)) / flat;
  return {r * scale * d[0], r * scale * d[1], r * z};
}

std::array<double, 3> LensScene::ray(std::uint32_t image,
                                     const std::array<double, 3>& point) const {
  const Matrix3<double>& R = rotations_[image];
  const Vector3<double> P = in_camera(R, poses_[image].translation, point);
  const double length = std::sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2]);
  return multiply(Matrix3<double>{R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]},
                  Vector3<double>{P[0] / length, P[1] / length, P[2] / length});
}

bool LensScene::sees(std::uint32_t image, const std::array<double, 3>& point,
                     std::array<double, 2>& pixel) const {
  const Vector3<double> P = in_camera(rotations_[image], poses_[image].translation, point);
  const double length = std::sqrt(P[0] * P[0] + P[1] * P[1] + P[2] * P[2]);
  if (length < 0.5 || P[2] < cosine_ * length) return false;
  const Camera& lens = lenses_[lens_of(image)];
  pixel = portable_pixel(lens, P);
  return pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] <= static_cast<double>(lens.width_px) &&
         pixel[1] <= static_cast<double>(lens.height_px);
}

}  // namespace sheaf
