// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/lens_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

#include "geometry/camera_model.h"
#include "platform/random.h"
#include "scene/portable_number.h"
#include "scene/portable_rotation.h"

namespace sheaf {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNarrowDeg = 65, kWideDeg = 200;  // unless asked for
constexpr double kMostNarrowDeg = 110, kMostWideDeg = 220;
constexpr double kOrbitRadius = 4, kWideFromDeg = 120;

enum Stream : std::uint64_t { kLenses = 1, kPlaces = 2 };

bool is_fisheye(CameraModel model) {
  switch (model) {
    case CameraModel::opencv_fisheye:
    case CameraModel::simple_radial_fisheye:
    case CameraModel::radial_fisheye:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::fov:
    case CameraModel::eucm:
      return true;
    default:
      return false;
  }
}

/// Distortion as real lenses have it; perspective models lose a tenth at the corners of 65 degrees,
/// and fisheyes grow monotonically to 110 degrees from the axis.
double usual(CameraModel model, std::string_view name) {
  const bool fisheye = is_fisheye(model);
  if (name == "k") return fisheye ? -0.02 : -0.12;
  if (name == "k1") return fisheye ? -0.02 : -0.15;
  if (name == "k2") return fisheye ? 0.003 : 0.04;
  if (name == "k3") return fisheye ? -6e-4 : -0.008;
  if (name == "k4") return fisheye ? 5e-5 : 0.02;
  if (name == "k5") return 0.01;
  if (name == "k6") return 0.002;
  if (name == "p1") return 6e-4;
  if (name == "p2") return -4e-4;
  if (name == "sx1") return 5e-4;
  if (name == "sy1") return -3e-4;
  if (name == "omega") return 0.9;
  if (name == "alpha") return 0.62;
  return name == "beta" ? 1.05 : 0;
}

std::array<double, 2> portable_pixel(const Camera& camera, const std::array<double, 3>& P) {
  PortableNumber k[kMaxCameraParameters], at[3];
  for (std::size_t i = 0; i < kMaxCameraParameters; ++i)
    k[i] = PortableNumber(camera.parameters[i]);
  for (std::size_t i = 0; i < 3; ++i) at[i] = PortableNumber(P[i]);
  LensJacobian<PortableNumber> J;
  with_lens(camera.model, [&](auto lens) {
    if constexpr (!std::is_same_v<decltype(lens), BalLens>) lens.project(k, at, J);
  });
  return {J.pixel[0].value, J.pixel[1].value};
}

/// A lens whose image is as large as its sensor: the diagonal of a 3:2 frame spans the field of
/// view, or the circle of a fisheye fills a square one.
Camera usual_lens(CameraModel model, double half_view_rad) {
  const bool square = is_fisheye(model);
  Camera lens{model, {}, square ? 1600u : 1800u, square ? 1600u : 1200u};
  const std::vector<std::string_view> names = parameter_names(model);
  for (std::size_t i = 0; i < names.size(); ++i) lens.parameters[i] = usual(model, names[i]);
  const ParameterRoles role = roles_of(model);
  auto& k = lens.parameters;
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  k[at(role.fx)] = k[at(role.fy)] = 1;
  const SineCosine edge = portable_sine_cosine(half_view_rad);
  const double reach = portable_pixel(lens, {edge.sine, 0, edge.cosine})[0];
  const double w = static_cast<double>(lens.width_px), h = static_cast<double>(lens.height_px);
  k[at(role.fx)] = (square ? w / 2 - 20 : std::sqrt(w * w + h * h) / 2) / reach;
  k[at(role.fy)] = role.fy == role.fx ? k[at(role.fx)] : 1.004 * k[at(role.fx)];
  k[at(role.cx)] = w / 2 + 6.5;
  k[at(role.cy)] = h / 2 - 4.25;
  return lens;
}

/// Rows are the camera's axes in the world: z along `ahead`, x turned by `roll` from the horizon.
Quaternion<double> looking(Vector3<double> ahead, double roll_rad) {
  const auto unit = [](Vector3<double> v) {
    const double n = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return Vector3<double>{v[0] / n, v[1] / n, v[2] / n};
  };
  const Vector3<double> z = unit(ahead);
  const Vector3<double> aside =
      std::abs(z[2]) < 0.9 ? Vector3<double>{0, 0, 1} : Vector3<double>{1, 0, 0};
  const Vector3<double> level = unit(cross(z, aside)), down = cross(z, level);
  const SineCosine roll = portable_sine_cosine(roll_rad);
  Vector3<double> x, y;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = roll.cosine * level[i] + roll.sine * down[i];
    y[i] = roll.cosine * down[i] - roll.sine * level[i];
  }
  return portable_quaternion(Matrix3<double>{x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]});
}

Vector3<double> in_camera(const Matrix3<double>& R, const Vector3<double>& t,
                          const Vector3<double>& X) {
  Vector3<double> P = multiply(R, X);
  for (std::size_t i = 0; i < 3; ++i) P[i] += t[i];
  return P;
}

Pose pose_at(const Quaternion<double>& rotation, const Vector3<double>& centre) {
  const Vector3<double> t = multiply(portable_matrix(rotation), centre);
  return {rotation, {-t[0], -t[1], -t[2]}};
}

}  // namespace

Result<double> field_of_view_deg(const LensSceneOptions& options) {
  const bool fisheye = is_fisheye(options.model);
  const double most = fisheye ? kMostWideDeg : kMostNarrowDeg;
  const double view = options.field_of_view_deg;
  if (view == 0) return fisheye ? kWideDeg : kNarrowDeg;
  if (view >= 5 && view <= most) return view;
  return Error(ErrorCode::usage, "the field of view of a synthetic " +
                                     std::string(to_string(options.model)) +
                                     " lens must be from 5 to " +
                                     std::to_string(static_cast<int>(most)) + " degrees");
}

LensScene::LensScene(const LensSceneOptions& options)
    : images_(static_cast<std::uint32_t>(options.scene.images)) {
  const double view = field_of_view_deg(options).value();
  half_view_rad_ = view / 2 * kDegree;
  cosine_ = portable_sine_cosine(half_view_rad_).cosine;
  wide_ = view >= kWideFromDeg;
  const CameraModel model = options.model == CameraModel::bal ? CameraModel::radial : options.model;
  const Camera first = usual_lens(model, half_view_rad_);
  const std::uint64_t count =
      options.lenses == 0 ? images_ : std::min<std::uint64_t>(options.lenses, images_);
  Random lens_random(options.scene.seed, kLenses);
  const ParameterRoles role = roles_of(model);
  for (std::uint64_t c = 0; c < count; ++c) {
    Camera lens = first;
    const double zoom = 1 + 0.02 * lens_random.normal();
    for (int i = 0; i < static_cast<int>(parameter_count(model)); ++i) {
      double& k = lens.parameters[static_cast<std::size_t>(i)];
      const double other = lens_random.normal();
      if (c == 0 || i == role.cx || i == role.cy) continue;
      k *= i == role.fx || i == role.fy ? std::clamp(zoom, 0.9, 1.1) : 1 + 0.05 * other;
    }
    lenses_.push_back(lens);
  }
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
