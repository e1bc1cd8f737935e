// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/noise.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "geometry/camera_model.h"
#include "platform/random.h"
#include "scene/rig_noise.h"
#include "scene/rigs.h"
#include "scene/subset.h"
#include "scene/view.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

// Streams of the seed. An outlier's own is kOutliers + its observation: nothing is drawn in turn.
constexpr std::uint64_t kRotations = 101, kTranslations = 102, kCenters = 103, kPoints = 104,
                        kLenses = 105, kPixels = 106, kOutliers = std::uint64_t{7} << 40;

Error refusal(const std::string& message) { return Error(ErrorCode::usage, message); }

Result<void> check_numbers(const NoiseOptions& o) {
  const std::pair<const char*, double> numbers[] = {
      {"rotation noise", o.rotation_rad},
      {"translation noise", o.translation},
      {"centre noise", o.center},
      {"point noise", o.point},
      {"rotation noise of sensors", o.sensor_rotation_rad},
      {"translation noise of sensors", o.sensor_translation},
      {"noise of f", o.intrinsics[0]},
      {"noise of k1", o.intrinsics[1]},
      {"noise of k2", o.intrinsics[2]},
      {"relative noise of f", o.intrinsics_relative[0]},
      {"relative noise of k1", o.intrinsics_relative[1]},
      {"relative noise of k2", o.intrinsics_relative[2]},
      {"pixel noise", o.pixel_px},
      {"fraction of outliers", o.outliers},
      {"size of outliers", o.outlier_px},
      {"size to normalise to", o.normalize_to},
      {"least depth", o.least_depth}};
  for (const auto& [name, value] : numbers)
    if (!(value >= 0) || !std::isfinite(value))
      return refusal(std::string("the ") + name + " must be a finite number from 0 up");
  if (o.outliers > 1) return refusal("the fraction of outliers must be at most 1");
  return {};
}

Result<void> check(const NoiseOptions& o) {
  if (Result<void> good = check_numbers(o); !good.ok()) return good;
  if (o.protocol > NoiseProtocol::rootba) return refusal("the protocol is none that there is");
  if (o.protocol == NoiseProtocol::ceres && o.center > 0)
    return refusal("Ceres' protocol has no noise on camera centres: its sigma is that of t");
  if (o.protocol == NoiseProtocol::rootba && o.translation > 0)
    return refusal("rootba's protocol has no noise on t: its sigma is that of camera centres");
  return {};
}

// Ends portable: the angle-axis is what is kept, and what a reader of the file would convert.
void set_rotation(Problem& problem, std::size_t image, const Vector3<double>& angle_axis) {
  std::copy(angle_axis.begin(), angle_axis.end(), &problem.bal_angle_axis[3 * image]);
  problem.poses[image].rotation = quaternion_from_angle_axis(angle_axis);
}

Vector3<double> sum(const Vector3<double>& a, const Vector3<double>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

Vector3<double> negative(const Vector3<double>& a) { return {-a[0], -a[1], -a[2]}; }

// R <- exp(phi) R; t = -R C, so t <- exp(phi) (t - R d) moves the centre by d.
void disturb_image(Problem& problem, std::size_t j, const NoiseOptions& o,
                   const Vector3<double>& phi, const Vector3<double>& d) {
  const Quaternion<double> before = portable_rotation(problem, j);
  Vector3<double>& t = problem.poses[j].translation;
  if (o.center > 0) t = sum(t, negative(multiply(portable_matrix(before), d)));
  if (o.rotation_rad == 0) return;
  const Quaternion<double> turn = portable_quaternion(phi);
  if (o.protocol == NoiseProtocol::ceres) {
    const auto stated = stated_rotation(problem, j);
    const Vector3<double> w = sum(stated ? *stated : portable_angle_axis(before), phi);
    // C = -R^T t is held: t <- R' R^T t.
    const Quaternion<double> back = {before[0], -before[1], -before[2], -before[3]};
    t = multiply(portable_matrix(multiply(portable_quaternion(w), back)), t);
    set_rotation(problem, j, w);
    return;
  }
  if (o.protocol == NoiseProtocol::sheaf) t = multiply(portable_matrix(turn), t);
  set_rotation(problem, j, portable_angle_axis(multiply(turn, before)));
}

// Every image draws its numbers; of a frame that moves several images, or a sensor's, those of the
// first are the frame's.
void disturb_images(Problem& problem, const NoiseOptions& o) {
  Random rotations(o.seed, kRotations), translations(o.seed, kTranslations),
      centers(o.seed, kCenters);
  Rigs& rigs = problem.rigs;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  std::vector<bool> moved(rigs.num_frames(), false);
  if (o.rotation_rad > 0) problem.bal_angle_axis.resize(3 * problem.num_images());
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Vector3<double> phi = normal3(rotations, o.rotation_rad), d = normal3(centers, o.center);
    const Vector3<double> e =
        o.translation > 0 ? normal3(translations, o.translation) : Vector3<double>{};
    const bool rigid = in_rig(rigs, j) && trivial[rigs.image_frame[j]] == 0;
    if (rigid && moved[rigs.image_frame[j]]) continue;
    if (rigid) moved[rigs.image_frame[j]] = true;
    Pose& pose = rigid ? rigs.rig_from_world[rigs.image_frame[j]] : problem.poses[j];
    rigid ? disturb_frame(pose, o, phi, d) : disturb_image(problem, j, o, phi, d);
    if (o.translation > 0) pose.translation = sum(pose.translation, e);
  }
  follow_images(problem);
  disturb_sensors(rigs, o);
  place_images(problem);
}

// f (fx and fy alike), k1 and k2; what a model does not have draws its number all the same.
void disturb_lenses(Problem& problem, const NoiseOptions& o) {
  Random random(o.seed, kLenses);
  for (Camera& camera : problem.cameras) {
    const ParameterRoles roles = roles_of(camera.model);
    const auto disturb = [&](int which, std::size_t k, double draw) {
      if (which < 0) return;
      double& parameter = camera.parameters[static_cast<std::size_t>(which)];
      parameter += (o.intrinsics[k] + o.intrinsics_relative[k] * std::fabs(parameter)) * draw;
    };
    const double f = random.normal();
    disturb(roles.fx, 0, f);
    if (roles.fy != roles.fx) disturb(roles.fy, 0, f);
    disturb(roles.k1, 1, random.normal());
    disturb(roles.k2, 2, random.normal());
  }
}

void add_noise(std::vector<double>& values, double sigma, std::uint64_t seed,
               std::uint64_t stream) {
  if (sigma == 0) return;
  Random random(seed, stream);
  for (double& x : values) x += sigma * random.normal();
}

// The observations of least rank, as many as the fraction makes, ascending.
std::vector<std::uint64_t> choose_outliers(std::uint64_t observations, const NoiseOptions& o) {
  const auto count =
      static_cast<std::uint64_t>(std::floor(o.outliers * static_cast<double>(observations) + 0.5));
  if (count == 0) return {};
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranks(observations);
  for (std::uint64_t i = 0; i < observations; ++i)
    ranks[i] = {Random(o.seed, kOutliers + i).next(), i};
  if (count < observations)
    std::nth_element(ranks.begin(), ranks.begin() + static_cast<std::ptrdiff_t>(count),
                     ranks.end());
  std::vector<std::uint64_t> chosen(count);
  for (std::uint64_t k = 0; k < count; ++k) chosen[k] = ranks[k].second;
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void move_outlier(Problem& problem, std::uint64_t i, const NoiseOptions& o) {
  Random random(o.seed, kOutliers + i);
  random.next();  // its rank
  const SineCosine direction = portable_sine_cosine(random.uniform(0, 6.28318530717958648));
  problem.observation_xy[2 * i] += o.outlier_px * direction.cosine;
  problem.observation_xy[2 * i + 1] += o.outlier_px * direction.sine;
}

// Distance in front of the image plane; BAL cameras look along -z, all others along +z. Panoramas
// have no such plane: there the distance from the centre.
double depth_of(const Problem& problem, const std::vector<Matrix3<double>>& rotations,
                std::uint64_t i) {
  const std::uint32_t j = problem.observation_image[i];
  const double* X = &problem.points[3 * std::size_t{problem.observation_point[i]}];
  const Matrix3<double>& R = rotations[j];
  const auto& t = problem.poses[j].translation;
  const auto along = [&](std::size_t k) {
    return R[3 * k] * X[0] + R[3 * k + 1] * X[1] + R[3 * k + 2] * X[2] + t[k];
  };
  const double z = along(2);
  const CameraModel model = problem.cameras[problem.image_camera[j]].model;
  if (model == CameraModel::equirectangular)
    return std::sqrt(along(0) * along(0) + along(1) * along(1) + z * z);
  return model == CameraModel::bal ? -z : z;
}

// The outliers among the observations that are left, by their new numbers.
std::vector<std::uint64_t> outliers_left(const std::vector<std::uint64_t>& outliers,
                                         const std::vector<bool>& kept) {
  std::vector<std::uint64_t> left;
  std::uint64_t to = 0;
  auto outlier = outliers.begin();
  for (std::uint64_t i = 0; i < kept.size() && outlier != outliers.end(); ++i) {
    const bool moved = *outlier == i;
    if (moved) ++outlier;
    if (moved && kept[i]) left.push_back(to);
    to += kept[i];
  }
  return left;
}

void drop_near(Problem& problem, double least_depth, NoiseRecord& record) {
  std::vector<Matrix3<double>> rotations;
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    rotations.push_back(portable_matrix(portable_rotation(problem, j)));
  const std::uint64_t observations = problem.num_observations(), points = problem.num_points();
  std::vector<bool> kept(observations);
  for (std::uint64_t i = 0; i < observations; ++i)
    kept[i] = depth_of(problem, rotations, i) >= least_depth;
  keep_observations(problem, kept, 2);
  record.outliers = outliers_left(record.outliers, kept);
  record.dropped_points = points - problem.num_points();
  record.dropped_observations = observations - problem.num_observations();
}

}  // namespace

NoiseOptions published_noise(NoiseProtocol protocol) {
  NoiseOptions options;
  options.protocol = protocol;
  if (protocol == NoiseProtocol::sheaf) return options;
  options.normalize_to = 100;
  options.seed = 38401;
  if (protocol == NoiseProtocol::rootba) {
    options.center = options.point = 0.01;
    options.least_depth = 0.1;
  }
  return options;
}

Result<NoiseRecord> perturb(Problem& problem, const NoiseOptions& options) {
  if (Result<void> good = check(options); !good.ok()) return good.error();
  if (Result<void> good = validate(problem); !good.ok()) return good.error();
  const bool sensors = options.sensor_rotation_rad > 0 || options.sensor_translation > 0;
  if (sensors && !has_free_sensors(problem.rigs))
    return refusal("there is no rig with sensors beside its reference, which never moves");
  NoiseRecord record;
  if (options.normalize_to > 0) {
    Result<Normalization> normalization = normalize(problem, options.normalize_to);
    if (!normalization.ok()) return normalization.error();
    record.normalization = normalization.value();
  }
  place_images(problem);
  disturb_images(problem, options);
  disturb_lenses(problem, options);
  add_noise(problem.points, options.point, options.seed, kPoints);
  add_noise(problem.observation_xy, options.pixel_px, options.seed, kPixels);
  record.outliers = choose_outliers(problem.num_observations(), options);
  for (const std::uint64_t i : record.outliers) move_outlier(problem, i, options);
  if (options.least_depth > 0) drop_near(problem, options.least_depth, record);
  return record;
}

}  // namespace sheaf
