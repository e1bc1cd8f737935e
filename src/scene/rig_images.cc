// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_images.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "platform/random.h"
#include "scene/portable_pose.h"
#include "scene/rigs.h"
#include "scene/scene_lenses.h"
#include "scene/view.h"

namespace sheaf {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kEye = 1.6, kBaseline = 0.5, kCircle = 0.3;
constexpr double kNear = 0.6, kFar = 24;  // distances at which a spot is seen
constexpr double kGrazing = 0.15;         // least sine of the angle to the surface

enum Stream : std::uint64_t { kMounts = 31, kFrames, kSingles, kMissing };

std::string numbered(const std::string& folder, std::uint64_t number) {
  std::string digits = std::to_string(number + 1);
  digits.insert(0, 6 - std::min<std::size_t>(6, digits.size()), '0');
  return folder + "/image" + digits + ".png";
}

/// sensor_from_rig of a camera turned to the right by `yaw_rad` and then a little at random.
Pose mounted(double yaw_rad, const Vector3<double>& centre, double crooked, Random& random) {
  const SineCosine yaw = portable_sine_cosine(yaw_rad);
  const Quaternion<double> straight = portable_quaternion(
      Matrix3<double>{yaw.cosine, 0, -yaw.sine, 0, 1, 0, yaw.sine, 0, yaw.cosine});
  const Quaternion<double> turn = portable_quaternion(normal3(random, crooked));
  return pose_at(normalized(multiply(turn, straight)), centre);
}

/// A camera that looks along the street from beside its middle.
Pose driven(const RigStreet::Place& place, const Vector3<double>& jitter, double aside,
            double yaw_rad, double shake, Random& random) {
  Vector3<double> centre, ahead;
  const SineCosine yaw = portable_sine_cosine(yaw_rad);
  const Vector3<double> turn = normal3(random, shake);
  for (std::size_t k = 0; k < 3; ++k) {
    centre[k] = place.position[k] + aside * place.left[k] + jitter[k];
    ahead[k] = yaw.cosine * place.ahead[k] + (yaw.sine + turn[0]) * place.left[k];
  }
  centre[2] += kEye;
  ahead[2] += turn[1];
  return pose_at(looking(ahead, turn[2]), centre);
}

}  // namespace

std::uint64_t sensors_of(const RigSceneOptions& o) {
  return o.sensors > 0 ? o.sensors : (o.kind == RigKind::stereo ? 2 : 6);
}

double view_deg_of(const RigSceneOptions& o) {
  if (o.field_of_view_deg > 0) return o.field_of_view_deg;
  return is_fisheye(o.model) ? 160 : (o.kind == RigKind::stereo ? 80 : 100);
}

RigImages::RigImages(const RigSceneOptions& options)
    : street_(static_cast<double>(options.frames), options.scene.seed),
      frames_(options.frames),
      looks_back_(options.kind == RigKind::around) {
  const double half_view_rad = view_deg_of(options) / 2 * kDegree;
  cosine_ = portable_sine_cosine(half_view_rad).cosine;
  const std::uint64_t sensors = sensors_of(options);
  const std::uint64_t lenses = options.one_lens ? 1 : sensors + (options.single_images > 0 ? 1 : 0);
  problem_.cameras = draw_lenses(options.model, half_view_rad, lenses, options.scene.seed);
  mount_sensors(options, sensors);
  Random frame_random(options.scene.seed, kFrames), single_random(options.scene.seed, kSingles);
  std::uint64_t singles = 0;
  for (std::uint64_t f = 0; f < frames_; ++f) {
    first_image_.push_back(static_cast<std::uint32_t>(problem_.num_images()));
    take_frame(options, frame_random);
    for (; singles * frames_ < options.single_images * (f + 1) && singles < options.single_images;
         ++singles)
      take_single(static_cast<double>(f), single_random);
  }
  first_image_.push_back(static_cast<std::uint32_t>(problem_.num_images()));
  place_images(problem_);
  auto metadata = std::make_shared<SceneMetadata>();
  metadata->image_names = std::move(names_);
  problem_.metadata = std::move(metadata);
  for (const Pose& pose : problem_.poses) {
    const Matrix3<double> R = portable_matrix(pose.rotation);
    const Vector3<double>& t = pose.translation;
    rotations_.push_back(R);
    centres_.push_back({-(R[0] * t[0] + R[3] * t[1] + R[6] * t[2]),
                        -(R[1] * t[0] + R[4] * t[1] + R[7] * t[2]),
                        -(R[2] * t[0] + R[5] * t[1] + R[8] * t[2])});
  }
}

void RigImages::mount_sensors(const RigSceneOptions& options, std::uint64_t sensors) {
  Random random(options.scene.seed, kMounts);
  Rigs& rigs = problem_.rigs;
  rigs.count = 1;
  for (std::uint64_t s = 0; s < sensors; ++s) {
    const double k = static_cast<double>(s);
    Pose pose = mounted(0, {kBaseline * k, 0, 0}, 0.01, random);
    if (options.kind == RigKind::around) {
      const double yaw = 2 * std::numbers::pi * k / static_cast<double>(sensors);
      const SineCosine at = portable_sine_cosine(yaw);
      pose = mounted(yaw, {kCircle * at.sine, 0, kCircle * (at.cosine - 1)}, 0.02, random);
    }
    rigs.sensor_from_rig.push_back(s == 0 ? Pose{} : pose);
    rigs.sensor_rig.push_back(0);
    rigs.is_reference.push_back(s == 0 ? 1 : 0);
  }
}

void RigImages::take_frame(const RigSceneOptions& options, Random& random) {
  Rigs& rigs = problem_.rigs;
  const std::uint64_t f = rigs.num_frames(), sensors = rigs.num_sensors();
  const double s = static_cast<double>(f) + random.uniform(-0.2, 0.2);
  rigs.rig_from_world.push_back(driven(street_.at(s), normal3(random, 0.05), 0, 0, 0.03, random));
  rigs.frame_rig.push_back(0);
  Random missing_random(options.scene.seed, (std::uint64_t{kMissing} << 40) + f);
  const bool misses = missing_random.uniform() < options.missing && sensors > 1;
  const std::uint64_t missed = missing_random.below(sensors);
  for (std::uint64_t k = 0; k < sensors; ++k) {
    if (misses && k == missed) continue;
    const auto sensor = static_cast<std::uint32_t>(k);
    add_image(f, static_cast<std::uint32_t>(f), sensor, options.one_lens ? 0 : sensor, {},
              numbered("rig1/camera" + std::to_string(k + 1), f));
  }
}

void RigImages::take_single(double s, Random& random) {
  const double at = s + random.uniform(), aside = random.uniform(-1, 1),
               yaw = random.uniform(-0.6, 0.6);
  const Pose pose = driven(street_.at(at), normal3(random, 0.1), aside, yaw, 0.05, random);
  const auto singles = static_cast<std::uint64_t>(
      std::count(problem_.rigs.image_frame.begin(), problem_.rigs.image_frame.end(), Rigs::kNone));
  add_image(static_cast<std::uint64_t>(s), Rigs::kNone, Rigs::kNone,
            static_cast<std::uint32_t>(problem_.cameras.size() - 1), pose,
            numbered("single", singles));
}

void RigImages::add_image(std::uint64_t frame, std::uint32_t of_frame, std::uint32_t sensor,
                          std::uint32_t camera, const Pose& pose, const std::string& name) {
  problem_.add_image(pose, camera);
  problem_.rigs.image_frame.push_back(of_frame);
  problem_.rigs.image_sensor.push_back(sensor);
  place_.push_back(frame);
  names_.push_back(name);
}

RigImages::Reach RigImages::reach() const {
  // A drive that ends sees some of the street before its first frame and beyond its last.
  const double last = static_cast<double>(frames_);
  if (street_.closed()) return {0, last};
  return {looks_back_ ? -12.0 : 0.0, last + 12};
}

std::vector<std::uint32_t> RigImages::near(double s) const {
  const auto count = static_cast<std::int64_t>(frames_);
  const auto middle = static_cast<std::int64_t>(std::floor(s));
  const auto range = static_cast<std::int64_t>(kRange);
  std::int64_t from = middle - range, to = middle + range;
  if (!street_.closed()) from = std::max<std::int64_t>(from, 0), to = std::min(to, count - 1);
  to = std::min(to, from + count - 1);
  std::vector<std::uint32_t> images;
  for (std::int64_t f = from; f <= to; ++f) {
    const auto frame = static_cast<std::size_t>((f % count + count) % count);
    for (std::uint32_t j = first_image_[frame]; j < first_image_[frame + 1]; ++j)
      images.push_back(j);
  }
  return images;
}

double RigImages::frames_between(std::uint32_t image, std::uint32_t other) const {
  const double apart =
      std::abs(static_cast<double>(place_[image]) - static_cast<double>(place_[other]));
  return street_.closed() ? std::min(apart, static_cast<double>(frames_) - apart) : apart;
}

bool RigImages::sees(std::uint32_t image, const RigStreet::Spot& spot,
                     std::array<double, 2>& pixel) const {
  const Vector3<double>& centre = centres_[image];
  Vector3<double> back;
  double square = 0, facing = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    back[k] = centre[k] - spot.X[k];
    square += back[k] * back[k];
    facing += back[k] * spot.normal[k];
  }
  const double distance = std::sqrt(square);
  const bool surface = spot.normal != Vector3<double>{};
  if (distance < kNear || distance > kFar || (surface && facing < kGrazing * distance))
    return false;
  Vector3<double> P = multiply(rotations_[image], spot.X);
  for (std::size_t k = 0; k < 3; ++k) P[k] += problem_.poses[image].translation[k];
  if (P[2] < cosine_ * distance) return false;
  const Camera& lens = problem_.cameras[problem_.image_camera[image]];
  pixel = portable_pixel(lens, P);
  return pixel[0] >= 0 && pixel[1] >= 0 && pixel[0] <= static_cast<double>(lens.width_px) &&
         pixel[1] <= static_cast<double>(lens.height_px);
}

Vector3<double> RigImages::ray(std::uint32_t image, const Vector3<double>& X) const {
  const Vector3<double>& C = centres_[image];
  Vector3<double> d{X[0] - C[0], X[1] - C[1], X[2] - C[2]};
  const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (double& x : d) x /= length;
  return d;
}

}  // namespace sheaf
