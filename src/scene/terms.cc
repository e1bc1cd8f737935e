// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/terms.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "geometry/camera_model.h"
#include "geometry/known_kinds.h"
#include "geometry/loss.h"
#include "geometry/motion_log.h"

namespace sheaf {
namespace {

using Kind = GaussianPrior::Block::Kind;

bool finite(const std::vector<double>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

std::optional<std::string> wrong_loss(const TermLoss& loss) {
  if (!is_known(loss.kind)) return "the loss is none that there is";
  if (loss.kind != LossKind::none && !(loss.scale > 0)) return "the loss needs a scale above 0";
  return {};
}

std::optional<std::string> wrong_position(const std::array<double, 3>& position,
                                          const Covariance3& covariance, const TermLoss& loss) {
  if (!finite({position.begin(), position.end()})) return "the position is not finite";
  if (!whitening(covariance)) return "the covariance is not symmetric and positive definite";
  return wrong_loss(loss);
}

std::size_t columns_of(const Problem& problem, const GaussianPrior::Block& block) {
  switch (block.kind) {
    case Kind::pose:
      return 6;
    case Kind::camera:
      return parameter_count(problem.cameras[block.index].model);
    case Kind::point:
      return 3;
  }
  return 0;
}

std::optional<std::string> wrong_block(const Problem& problem, const GaussianPrior::Block& block) {
  if (block.kind > Kind::point) return "a block is of no kind that there is";
  const std::size_t count = block.kind == Kind::pose     ? problem.num_images()
                            : block.kind == Kind::camera ? problem.cameras.size()
                                                         : problem.num_points();
  if (block.index >= count)
    return "a block names entry " + std::to_string(block.index) + ", expected one below " +
           std::to_string(count);
  const std::size_t state = block.kind == Kind::pose ? 7 : columns_of(problem, block);
  if (block.state.size() != state || !finite(block.state))
    return "a block's state must be " + std::to_string(state) + " finite numbers";
  return {};
}

std::optional<std::string> wrong_gaussian(const Problem& problem, const GaussianPrior& prior) {
  std::size_t columns = 0;
  for (const GaussianPrior::Block& block : prior.blocks) {
    if (auto wrong = wrong_block(problem, block)) return wrong;
    columns += columns_of(problem, block);
  }
  if (columns == 0 || prior.square_root.empty() || prior.square_root.size() % columns != 0)
    return "square_root must have rows of " + std::to_string(columns) + " columns";
  if (!prior.mean.empty() && prior.mean.size() != columns)
    return "mean must be empty or have " + std::to_string(columns) + " entries";
  if (!finite(prior.square_root) || !finite(prior.mean)) return "a number is not finite";
  return wrong_loss(prior.loss);
}

template <class Term>
std::string at(const char* what, const std::vector<Term>& all, const Term& term,
               const std::string& wrong) {
  return std::string(what) + " " + std::to_string(&term - all.data()) + ": " + wrong;
}

}  // namespace

std::vector<BoundReached> bounds_reached(const Problem& problem) {
  std::vector<BoundReached> out;
  for (const ParameterBound& of : problem.terms.bounds) {
    const Camera& camera = problem.cameras[of.camera];
    const double value = camera.parameters[of.parameter];
    if (value == of.lower || value == of.upper)
      out.push_back({of.camera, of.parameter,
                     std::string(parameter_names(camera.model)[of.parameter]), value,
                     value == of.upper});
  }
  return out;
}

std::optional<std::array<double, 9>> whitening(const Covariance3& C) {
  for (const double x : C)
    if (!std::isfinite(x)) return {};
  for (const auto& [a, b] : {std::pair{1, 3}, {2, 6}, {5, 7}})
    if (std::abs(C[a] - C[b]) > 1e-12 * (std::abs(C[a]) + std::abs(C[b]))) return {};
  // C = R R^T with R upper triangular, so that U = R^-1 is upper triangular too.
  const double r22 = std::sqrt(C[8]);
  const double r12 = C[5] / r22, r02 = C[2] / r22;
  const double r11 = std::sqrt(C[4] - r12 * r12);
  const double r01 = (C[1] - r02 * r12) / r11;
  const double r00 = std::sqrt(C[0] - r01 * r01 - r02 * r02);
  if (!(r00 > 0) || !(r11 > 0) || !(r22 > 0)) return {};
  const double u01 = -r01 / (r00 * r11), u12 = -r12 / (r11 * r22);
  const double u02 = (r01 * r12 / r11 - r02) / (r00 * r22);
  return std::array<double, 9>{1 / r00, u01, u02, 0, 1 / r11, u12, 0, 0, 1 / r22};
}

namespace {

double half_rho(const TermLoss& loss, double square) {
  return evaluate_loss({loss.kind, loss.scale}, square).value / 2;
}

/// e^T C^-1 e.
double whitened_square(const Covariance3& covariance, const Vector3<double>& e) {
  const Vector3<double> r = multiply(*whitening(covariance), e);
  return r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
}

Vector3<double> point_at(const Problem& problem, std::uint32_t point) {
  const double* X = &problem.points[3 * std::size_t(point)];
  return {X[0], X[1], X[2]};
}

double cost_of(const Problem& problem, const CentrePrior& of) {
  const Pose pose = pose_of(problem, of.image);
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Vector3<double> e;
  for (std::size_t k = 0; k < 3; ++k) {
    e[k] = -of.position[k];
    for (std::size_t i = 0; i < 3; ++i)
      e[k] += R[3 * i + k] * (of.lever_arm[i] - pose.translation[i]);
  }
  return half_rho(of.loss, whitened_square(of.covariance, e));
}

RigidMotion<double> motion_of(const Problem& problem, std::uint32_t image) {
  const Pose pose = pose_of(problem, image);
  return {pose.rotation, pose.translation};
}

double cost_of(const Problem& problem, const RotationPrior& of) {
  const Quaternion<double>& q = of.rotation;
  const Vector3<double> phi = angle_axis_from_quaternion(
      multiply(pose_of(problem, of.image).rotation, Quaternion<double>{q[0], -q[1], -q[2], -q[3]}));
  return half_rho(of.loss, whitened_square(of.covariance, phi));
}

double cost_of(const Problem& problem, const GravityPrior& of) {
  const Matrix3<double> R = matrix_from_quaternion(pose_of(problem, of.image).rotation);
  const Vector3<double> e = cross(multiply(R, of.down), of.measured);
  return half_rho(of.loss,
                  (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) / (of.sigma_rad * of.sigma_rad));
}

double cost_of(const Problem& problem, const RelativePosePrior& of) {
  const auto b_from_a =
      composed(motion_of(problem, of.second), inverse(motion_of(problem, of.first)));
  const auto d = log_of(composed(b_from_a, inverse<double>({of.rotation, of.translation})));
  double square = 0;
  for (std::size_t row = 0; row < 6; ++row) {
    double r = 0;
    for (std::size_t k = 0; k < 6; ++k) r += of.square_root[6 * row + k] * d[k];
    square += r * r;
  }
  return half_rho(of.loss, square);
}

double cost_of(const Problem& problem, const ParameterPrior& of) {
  const double r = (problem.cameras[of.camera].parameters[of.parameter] - of.value) / of.sigma;
  return half_rho(of.loss, r * r);
}

double cost_of(const Problem& problem, const PointPrior& of) {
  Vector3<double> e = point_at(problem, of.point);
  for (std::size_t k = 0; k < 3; ++k) e[k] -= of.position[k];
  return whitened_square(of.covariance, e) / 2;
}

double cost_of(const Problem& problem, const DistancePrior& of) {
  const Vector3<double> a = point_at(problem, of.first), b = point_at(problem, of.second);
  const double r = (std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) - of.distance) / of.sigma;
  return half_rho(of.loss, r * r);
}

double cost_of(const Problem& problem, const GaussianPrior& of) {
  std::vector<double> d;
  for (const GaussianPrior::Block& block : of.blocks) {
    const std::vector<double>& s = block.state;
    if (block.kind == Kind::pose) {
      const Pose pose = pose_of(problem, block.index);
      const RigidMotion<double> state{{s[0], s[1], s[2], s[3]}, {s[4], s[5], s[6]}};
      const auto log =
          log_of(composed<double>({pose.rotation, pose.translation}, inverse<double>(state)));
      d.insert(d.end(), log.begin(), log.end());
      continue;
    }
    const Vector3<double> X =
        block.kind == Kind::point ? point_at(problem, block.index) : Vector3<double>{};
    for (std::size_t k = 0; k < s.size(); ++k)
      d.push_back((block.kind == Kind::point ? X[k] : problem.cameras[block.index].parameters[k]) -
                  s[k]);
  }
  double square = 0;
  for (std::size_t row = 0; row < of.square_root.size() / d.size(); ++row) {
    double r = 0;
    for (std::size_t k = 0; k < d.size(); ++k)
      r += of.square_root[row * d.size() + k] * (of.mean.empty() ? d[k] : d[k] - of.mean[k]);
    square += r * r;
  }
  return half_rho(of.loss, square);
}

}  // namespace

TermCosts evaluate_terms(const Problem& problem) {
  TermCosts out;
  for (const auto& of : problem.terms.centres) out.centres += cost_of(problem, of);
  for (const auto& of : problem.terms.rotations) out.rotations += cost_of(problem, of);
  for (const auto& of : problem.terms.gravities) out.gravities += cost_of(problem, of);
  for (const auto& of : problem.terms.relative_poses) out.relative_poses += cost_of(problem, of);
  for (const auto& of : problem.terms.parameters) out.parameters += cost_of(problem, of);
  for (const auto& of : problem.terms.points) out.points += cost_of(problem, of);
  for (const auto& of : problem.terms.distances) out.distances += cost_of(problem, of);
  for (const auto& of : problem.terms.gaussians) out.gaussians += cost_of(problem, of);
  return out;
}

std::vector<std::uint32_t> kept_points(const Terms& terms) {
  std::vector<std::uint32_t> kept = terms.kept_points;
  for (const DistancePrior& of : terms.distances) kept.insert(kept.end(), {of.first, of.second});
  for (const GaussianPrior& of : terms.gaussians)
    for (const GaussianPrior::Block& block : of.blocks)
      if (block.kind == Kind::point) kept.push_back(block.index);
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  return kept;
}

namespace {

bool is_unit(const double* v, std::size_t count) {
  double norm2 = 0;
  for (std::size_t k = 0; k < count; ++k) norm2 += v[k] * v[k];
  return std::abs(norm2 - 1) < 1e-6;
}

std::optional<std::string> wrong_term(const Problem& problem, const RotationPrior& of) {
  if (of.image >= problem.num_images()) return "it names an image that there is not";
  if (!is_unit(of.rotation.data(), 4)) return "the rotation is not a unit quaternion";
  if (!whitening(of.covariance)) return "the covariance is not symmetric and positive definite";
  return wrong_loss(of.loss);
}

std::optional<std::string> wrong_term(const Problem& problem, const GravityPrior& of) {
  if (of.image >= problem.num_images()) return "it names an image that there is not";
  if (!is_unit(of.measured.data(), 3) || !is_unit(of.down.data(), 3))
    return "both directions must be unit vectors";
  if (!(of.sigma_rad > 0) || !std::isfinite(of.sigma_rad))
    return "the sigma must be a finite number above 0";
  return wrong_loss(of.loss);
}

std::optional<std::string> wrong_term(const Problem& problem, const RelativePosePrior& of) {
  if (of.first >= problem.num_images() || of.second >= problem.num_images())
    return "it names an image that there is not";
  if (of.first == of.second) return "both images are the same";
  if (!is_unit(of.rotation.data(), 4)) return "the rotation is not a unit quaternion";
  if (!finite({of.translation.begin(), of.translation.end()}) ||
      !finite({of.square_root.begin(), of.square_root.end()}))
    return "a number is not finite";
  return wrong_loss(of.loss);
}

std::optional<std::string> wrong_parameter(const Problem& problem, std::uint32_t camera,
                                           std::uint32_t parameter) {
  if (camera >= problem.cameras.size()) return "it names a camera that there is not";
  const CameraModel model = problem.cameras[camera].model;
  if (parameter >= parameter_count(model))
    return std::string(to_string(model)) + " has " + std::to_string(parameter_count(model)) +
           " parameters";
  return {};
}

std::optional<std::string> wrong_term(const Problem& problem, const ParameterPrior& of) {
  if (auto wrong = wrong_parameter(problem, of.camera, of.parameter)) return wrong;
  if (!(of.sigma > 0) || !std::isfinite(of.sigma) || !std::isfinite(of.value))
    return "the value must be finite, its sigma finite and above 0";
  return wrong_loss(of.loss);
}

std::optional<std::string> wrong_term(const Problem& problem, const ParameterBound& of) {
  if (auto wrong = wrong_parameter(problem, of.camera, of.parameter)) return wrong;
  if (!(of.lower <= of.upper)) return "the lower end is above the upper one";
  const double value = problem.cameras[of.camera].parameters[of.parameter];
  if (!(of.lower <= value && value <= of.upper)) return "the parameter starts outside it";
  return {};
}

std::optional<std::string> wrong_bounds(const Problem& problem) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> bounded;
  for (const ParameterBound& of : problem.terms.bounds) {
    auto wrong = wrong_term(problem, of);
    if (!wrong && !bounded.insert({of.camera, of.parameter}).second)
      wrong = "the parameter has another one";
    if (wrong) return at("bound", problem.terms.bounds, of, *wrong);
  }
  return {};
}

std::optional<std::string> wrong_pose_terms(const Problem& problem) {
  const auto first_wrong = [&](const char* what, const auto& all) -> std::optional<std::string> {
    for (const auto& of : all)
      if (const auto wrong = wrong_term(problem, of)) return at(what, all, of, *wrong);
    return {};
  };
  const Terms& terms = problem.terms;
  if (auto wrong = first_wrong("rotation prior", terms.rotations)) return wrong;
  if (auto wrong = first_wrong("gravity", terms.gravities)) return wrong;
  if (auto wrong = first_wrong("relative pose", terms.relative_poses)) return wrong;
  return first_wrong("parameter prior", terms.parameters);
}

}  // namespace

std::optional<std::string> wrong_terms(const Problem& problem) {
  const Terms& terms = problem.terms;
  for (const CentrePrior& of : terms.centres) {
    auto wrong = wrong_position(of.position, of.covariance, of.loss);
    if (of.image >= problem.num_images()) wrong = "it names an image that there is not";
    if (wrong) return at("centre prior", terms.centres, of, *wrong);
  }
  if (auto wrong = wrong_pose_terms(problem)) return wrong;
  if (auto wrong = wrong_bounds(problem)) return wrong;
  std::set<std::uint32_t> named;
  for (const PointPrior& of : terms.points) {
    auto wrong = wrong_position(of.position, of.covariance, {});
    if (of.point >= problem.num_points()) wrong = "it names a point that there is not";
    if (!wrong && !named.insert(of.point).second) wrong = "the point has another one: combine them";
    if (wrong) return at("point prior", terms.points, of, *wrong);
  }
  for (const DistancePrior& of : terms.distances) {
    std::optional<std::string> wrong;
    if (of.first >= problem.num_points() || of.second >= problem.num_points())
      wrong = "it names a point that there is not";
    else if (of.first == of.second)
      wrong = "both ends are the same point";
    else if (!(of.sigma > 0) || !std::isfinite(of.sigma) || !(of.distance >= 0) ||
             !std::isfinite(of.distance))
      wrong = "the distance must be finite and at least 0, its sigma finite and above 0";
    else
      wrong = wrong_loss(of.loss);
    if (wrong) return at("distance", terms.distances, of, *wrong);
  }
  for (const GaussianPrior& of : terms.gaussians)
    if (const auto wrong = wrong_gaussian(problem, of))
      return at("Gaussian", terms.gaussians, of, *wrong);
  for (const std::uint32_t point : terms.kept_points)
    if (point >= problem.num_points())
      return "kept point " + std::to_string(point) + " is not one of the " +
             std::to_string(problem.num_points()) + " points";
  return {};
}

}  // namespace sheaf
