// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "starts/bearing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/camera_model.h"

namespace sheaf {
namespace {

Vector3<double> unit(Vector3<double> v) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (double& x : v) x /= length;
  return v;
}

/// Two unit vectors across d.
std::array<Vector3<double>, 2> across(const Vector3<double>& d) {
  const bool along_x = std::fabs(d[0]) > 0.9;
  const Vector3<double> u = unit(cross(d, {along_x ? 0.0 : 1.0, along_x ? 1.0 : 0.0, 0.0}));
  return {u, cross(d, u)};
}

Vector3<double> first_guess(const Camera& camera, const double* pixel) {
  const ParameterRoles roles = roles_of(camera.model);
  const auto at = [&](int k) {
    return k < 0 ? 0.0 : camera.parameters[static_cast<std::size_t>(k)];
  };
  const double x = (pixel[0] - at(roles.cx)) / at(roles.fx);
  const double y = (pixel[1] - at(roles.cy)) / at(roles.fy);
  const double r = std::sqrt(x * x + y * y);
  // Where a perspective lens has tan(angle) = r a wide one has about r = angle.
  const double angle = std::min(std::atan(r), 1.4);
  const double k = r > 0 ? std::sin(angle) / r : 1;
  const double forward = camera.model == CameraModel::bal ? -1 : 1;
  return {k * x, k * y, forward * std::cos(angle)};
}

std::optional<Vector3<double>> in_panorama(const Camera& camera, const double* pixel) {
  const double theta = 2 * std::numbers::pi * (pixel[0] / camera.parameters[0] - 0.5);
  const double phi = std::numbers::pi * (pixel[1] / camera.parameters[1] - 0.5);
  if (!(std::fabs(phi) <= std::numbers::pi / 2) || !std::isfinite(theta)) return std::nullopt;
  const double flat = std::cos(phi);
  return Vector3<double>{flat * std::sin(theta), std::sin(phi), flat * std::cos(theta)};
}

}  // namespace

std::optional<Vector3<double>> bearing(const Camera& camera, const double* pixel) {
  if (camera.model == CameraModel::equirectangular) return in_panorama(camera, pixel);
  constexpr int kSteps = 20;
  constexpr double kFarthest = 0.3;  // radians in one step
  constexpr double kNear_px = 0.5;
  Vector3<double> d = first_guess(camera, pixel);
  if (!std::isfinite(d[0] + d[1] + d[2])) return std::nullopt;
  for (int i = 0; i < kSteps; ++i) {
    const LensJacobian<double> at = project_with_jacobian(camera, d);
    const std::array<double, 2> r = residual(camera, at.pixel, pixel);
    const auto basis = across(d);
    double J[2][2];
    for (std::size_t row = 0; row < 2; ++row)
      for (std::size_t k = 0; k < 2; ++k)
        J[row][k] = at.point[row][0] * basis[k][0] + at.point[row][1] * basis[k][1] +
                    at.point[row][2] * basis[k][2];
    const double det = J[0][0] * J[1][1] - J[0][1] * J[1][0];
    double a = -(J[1][1] * r[0] - J[0][1] * r[1]) / det;
    double b = -(J[0][0] * r[1] - J[1][0] * r[0]) / det;
    const double length = std::sqrt(a * a + b * b);
    if (!std::isfinite(length)) return std::nullopt;
    const double k = std::min(1.0, kFarthest / std::max(length, 1e-300));
    a *= k, b *= k;
    for (std::size_t c = 0; c < 3; ++c) d[c] += a * basis[0][c] + b * basis[1][c];
    d = unit(d);
    if (length < 1e-9) break;
  }
  const Projected seen = project(camera, d);
  const auto [x, y] = residual(camera, seen.pixel, pixel);
  if (!seen.before || !(x * x + y * y < kNear_px * kNear_px)) return std::nullopt;
  return d;
}

Camera without_distortion(const Camera& camera) {
  Camera plain = camera;
  if (image_size(camera.model) != 0) return plain;
  const ParameterRoles roles = roles_of(camera.model);
  for (std::size_t k = 0; k < parameter_count(camera.model); ++k) {
    const int i = static_cast<int>(k);
    if (i != roles.fx && i != roles.fy && i != roles.cx && i != roles.cy) plain.parameters[k] = 0;
  }
  if (camera.model == CameraModel::fov) plain.parameters[4] = 1e-3;
  if (camera.model == CameraModel::eucm) plain.parameters[5] = 1;
  return plain;
}

}  // namespace sheaf
