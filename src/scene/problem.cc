// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/problem.h"

#include <bit>
#include <cmath>
#include <string>

#include "geometry/camera_model.h"
#include "geometry/known_kinds.h"
#include "geometry/rotation.h"
#include "scene/rigs.h"
#include "scene/source_files.h"
#include "scene/terms.h"

namespace sheaf {

std::uint32_t Problem::add_image(const Pose& pose, const Camera& camera) {
  cameras.push_back(camera);
  return add_image(pose, static_cast<std::uint32_t>(cameras.size() - 1));
}

std::uint32_t Problem::add_image(const Pose& pose, std::uint32_t camera) {
  poses.push_back(pose);
  image_camera.push_back(camera);
  return static_cast<std::uint32_t>(poses.size() - 1);
}

std::uint32_t Problem::add_point(double x, double y, double z) {
  points.insert(points.end(), {x, y, z});
  return static_cast<std::uint32_t>(num_points() - 1);
}

void Problem::add_observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) {
  observation_image.push_back(image);
  observation_point.push_back(point);
  observation_xy.insert(observation_xy.end(), {x_px, y_px});
}

namespace {

Error invalid(const std::string& message) { return Error(ErrorCode::usage, message); }

std::string numbered(const char* what, std::size_t i) {
  return std::string(what) + " " + std::to_string(i);
}

/// ": found 99, expected an image below 3"
std::string beyond(const char* what, std::uint64_t index, std::size_t count) {
  return ": found " + std::to_string(index) + ", expected " + what + " below " +
         std::to_string(count);
}

Result<void> validate_sizes(const Problem& p) {
  if (p.image_camera.size() != p.poses.size())
    return invalid("image_camera has " + std::to_string(p.image_camera.size()) + " entries for " +
                   std::to_string(p.poses.size()) + " poses");
  if (p.points.size() % 3 != 0) return invalid("points does not hold three numbers for each point");
  if (p.observation_point.size() != p.num_observations() ||
      p.observation_xy.size() != 2 * p.num_observations())
    return invalid(
        "observation arrays disagree in length: " + std::to_string(p.observation_image.size()) +
        " images, " + std::to_string(p.observation_point.size()) + " points, " +
        std::to_string(p.observation_xy.size()) + " coordinates");
  if (!p.bal_angle_axis.empty() && p.bal_angle_axis.size() != 3 * p.num_images())
    return invalid("bal_angle_axis must be empty or hold three numbers for each image");
  if (!p.observation_sigma.empty() && p.observation_sigma.size() != p.num_observations())
    return invalid("observation_sigma must be empty or have one entry for each observation");
  if (p.num_images() >= UINT32_MAX || p.num_points() >= UINT32_MAX)
    return invalid("more than 2^32 - 2 images or points");
  return {};
}

Result<void> validate_models(const Problem& p) {
  for (std::size_t i = 0; i < p.cameras.size(); ++i)
    if (!is_known(p.cameras[i].model))
      return invalid(numbered("camera", i) + beyond("the number of a model",
                                                    static_cast<std::uint64_t>(p.cameras[i].model),
                                                    kCameraModels));
  return {};
}

/// Memory that is not there is read by nobody, whatever else is wrong.
Result<void> check_places(const Problem& p) {
  if (Result<void> sizes = validate_sizes(p); !sizes.ok()) return sizes;
  if (Result<void> models = validate_models(p); !models.ok()) return models;
  for (std::size_t i = 0; i < p.num_images(); ++i)
    if (p.image_camera[i] >= p.cameras.size())
      return invalid(numbered("image", i) + " names camera " + std::to_string(p.image_camera[i]) +
                     " of " + std::to_string(p.cameras.size()));
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (p.observation_image[i] >= p.num_images() || p.observation_point[i] >= p.num_points())
      return invalid(
          numbered("observation", i) + " names image " + std::to_string(p.observation_image[i]) +
          " of " + std::to_string(p.num_images()) + " and point " +
          std::to_string(p.observation_point[i]) + " of " + std::to_string(p.num_points()));
  return {};
}

Result<void> validate_images(const Problem& p) {
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    if (p.image_camera[i] >= p.cameras.size())
      return invalid(numbered("image", i) +
                     beyond("a camera", p.image_camera[i], p.cameras.size()));
    double norm2 = 0;
    for (double q : p.poses[i].rotation) norm2 += q * q;
    if (!(std::abs(norm2 - 1) < 1e-6))
      return invalid(numbered("pose", i) + ": the rotation is not a unit quaternion");
    for (double t : p.poses[i].translation)
      if (!std::isfinite(t))
        return invalid(numbered("pose", i) + ": the translation is not finite");
  }
  for (std::size_t i = 0; i < p.cameras.size(); ++i)
    for (double k : p.cameras[i].parameters)
      if (!std::isfinite(k)) return invalid(numbered("camera", i) + ": a parameter is not finite");
  return {};
}

Result<void> validate_observations(const Problem& p) {
  for (std::size_t i = 0; i < p.points.size(); ++i)
    if (!std::isfinite(p.points[i]))
      return invalid(numbered("point", i / 3) + ": a coordinate is not finite");
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    if (p.observation_image[i] >= p.num_images())
      return invalid(numbered("observation", i) +
                     beyond("an image", p.observation_image[i], p.num_images()));
    if (p.observation_point[i] >= p.num_points())
      return invalid(numbered("observation", i) +
                     beyond("a point", p.observation_point[i], p.num_points()));
    if (!std::isfinite(p.observation_xy[2 * i]) || !std::isfinite(p.observation_xy[2 * i + 1]))
      return invalid(numbered("observation", i) + ": the pixel is not finite");
  }
  for (std::size_t i = 0; i < p.observation_sigma.size(); ++i)
    if (!(p.observation_sigma[i] > 0))
      return invalid(numbered("observation", i) + ": the sigma is not a number above 0");
  return {};
}

Result<void> validate_rigs(const Problem& p) {
  if (const auto wrong = wrong_rigs(p)) return invalid(*wrong);
  return {};
}

Result<void> validate_terms(const Problem& p) {
  if (const auto wrong = wrong_terms(p)) return invalid(*wrong);
  return {};
}

Result<void> validate_metadata(const Problem& p) {
  if (p.metadata == nullptr) return {};
  const SceneMetadata& m = *p.metadata;
  const auto fits = [](const auto& list, std::size_t count) {
    return list.empty() || list.size() == count;
  };
  const bool images = fits(m.image_ids, p.num_images()) && fits(m.image_names, p.num_images()) &&
                      fits(m.feature_begin, p.num_images() + 1) &&
                      (fits(m.stated_rotations, 4 * p.num_images()) ||
                       fits(m.stated_rotations, 9 * p.num_images()));
  const bool points = fits(m.point_ids, p.num_points()) && fits(m.point_colours, p.num_points()) &&
                      fits(m.point_errors_px, p.num_points());
  const bool observations =
      fits(m.observation_feature, p.num_observations()) &&
      (m.feature_begin.empty() || (m.observation_feature.size() == p.num_observations() &&
                                   m.feature_xy.size() == 2 * m.feature_begin.back()));
  if (images && points && observations && fits(m.camera_ids, p.cameras.size())) return {};
  return invalid(std::string("the metadata describe another number of ") +
                 (!images         ? "images"
                  : !points       ? "points"
                  : !observations ? "observations"
                                  : "lenses") +
                 " than the problem has: set them anew, or to null");
}

/// Neumaier's compensated sum.
struct CompensatedSum {
  double sum = 0, correction = 0;
  void add(double x) {
    const double t = sum + x;
    correction += std::abs(sum) >= std::abs(x) ? (sum - t) + x : (x - t) + sum;
    sum = t;
  }
  double value() const { return sum + correction; }
};

}  // namespace

Result<void> validate(const Problem& problem) {
  for (const auto& check : {validate_sizes, validate_models, validate_images, validate_observations,
                            validate_rigs, validate_terms, validate_metadata})
    if (Result<void> result = check(problem); !result.ok()) return result;
  return {};
}

Evaluation evaluate(const Problem& problem) {
  check_places(problem).value();
  std::vector<Matrix3<double>> rotations;
  rotations.reserve(problem.num_images());
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    poses.push_back(pose_of(problem, i));
    rotations.push_back(matrix_from_quaternion(poses.back().rotation));
  }

  Evaluation out;
  CompensatedSum sum, weighted;
  std::size_t finite = 0;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const double sigma = problem.observation_sigma.empty() ? 1 : problem.observation_sigma[i];
    if (std::isinf(sigma)) continue;  // switched off
    const std::uint32_t image = problem.observation_image[i];
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    const auto& t = poses[image].translation;
    Vector3<double> P = multiply(rotations[image], Vector3<double>{X[0], X[1], X[2]});
    for (int j = 0; j < 3; ++j) P[j] += t[j];
    const Camera& camera = problem.cameras[problem.image_camera[image]];
    const Projected u = project(camera, P);
    const auto [dx, dy] = residual(camera, u.pixel, &problem.observation_xy[2 * i]);
    const double square = dx * dx + dy * dy;
    if (!u.before) out.behind.push_back(i);
    if (!std::isfinite(square)) {
      out.not_finite.push_back(i);
      continue;
    }
    sum.add(square);
    weighted.add(square / (sigma * sigma));
    ++finite;
  }
  out.cost = weighted.value() / 2;
  out.rms_px = finite > 0 ? std::sqrt(sum.value() / static_cast<double>(finite)) : 0;
  return out;
}

std::vector<ParameterSet> held_parameters(const Problem& problem, const Fixed& fixed) {
  const auto bit = [](int i) { return static_cast<ParameterSet>(i < 0 ? 0u : 1u << i); };
  constexpr ParameterSet kAll = 0xffff;
  std::vector<ParameterSet> held;
  std::vector<ParameterRoles> roles;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const CameraModel model = problem.cameras[c].model;
    const ParameterRoles& role = roles.emplace_back(roles_of(model));
    ParameterSet set = fixed.parameters.empty() ? usually_held(problem, c) : fixed.parameters[c];
    if (fixed.f) set |= bit(role.fx) | bit(role.fy);
    if (fixed.k1) set |= bit(role.k1);
    if (fixed.k2) set |= bit(role.k2);
    held.push_back(fixed.intrinsics ? kAll : static_cast<ParameterSet>(set | image_size(model)));
  }
  for (std::uint32_t c : fixed.camera_ids) held[c] = kAll;
  for (std::uint32_t c : fixed.k1_ids) held[c] |= bit(roles[c].k1);
  for (std::uint32_t c : fixed.k2_ids) held[c] |= bit(roles[c].k2);
  return held;
}

std::uint64_t state_hash(const Problem& problem) {
  std::uint64_t hash = 0x9e3779b97f4a7c15u;
  const auto mix = [&hash](std::uint64_t word) {
    hash = (std::rotl(hash, 23) ^ word) * 0xd6e8feb86659fd93u;
    hash ^= hash >> 32;
  };
  const auto add = [&mix](const auto& numbers) {
    for (const double x : numbers) mix(std::bit_cast<std::uint64_t>(x));
  };
  for (const Pose& pose : problem.poses) add(pose.rotation), add(pose.translation);
  for (const Camera& camera : problem.cameras)
    mix(static_cast<std::uint64_t>(camera.model)), add(camera.parameters);
  add(problem.points);
  add(problem.observation_xy);
  add(problem.observation_sigma);
  for (const auto* motions : {&problem.rigs.sensor_from_rig, &problem.rigs.rig_from_world})
    for (const Pose& pose : *motions) add(pose.rotation), add(pose.translation);
  for (const std::uint32_t i : problem.image_camera) mix(i);
  for (const std::uint32_t i : problem.observation_image) mix(i);
  for (const std::uint32_t i : problem.observation_point) mix(i);
  for (const auto* indices : {&problem.rigs.image_frame, &problem.rigs.image_sensor})
    for (const std::uint32_t i : *indices) mix(i);
  return hash;
}

}  // namespace sheaf
