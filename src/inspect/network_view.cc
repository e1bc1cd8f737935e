// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/network_view.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "geometry/rotation.h"

namespace sheaf {
namespace {

std::vector<Vector3<double>> centers_of(const Problem& problem) {
  std::vector<Vector3<double>> centers;
  for (const Pose& pose : problem.poses) {
    const Quaternion<double>& q = pose.rotation;
    const Vector3<double> c =
        multiply(matrix_from_quaternion<double>({q[0], -q[1], -q[2], -q[3]}), pose.translation);
    centers.push_back({-c[0], -c[1], -c[2]});
  }
  return centers;
}

/// The middle 98% of the values (of twenty and more all but the least and the largest, at most),
/// and a fifth more on each side.
std::array<double, 2> window(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size(), left_out = n >= 20 ? std::max<std::size_t>(1, n / 100) : 0;
  const double low = values[left_out], high = values[n - 1 - left_out];
  return {low - 0.2 * (high - low), high + 0.2 * (high - low)};
}

// Only what lies in the window of each coordinate: a stray camera must not turn the plane.
Eigen::Matrix3d principal_axes(const std::vector<Vector3<double>>& centers) {
  std::array<std::array<double, 2>, 3> windows;
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (const auto& c : centers) values.push_back(c[k]);
    windows[k] = window(values);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> inside;
  for (const auto& c : centers) {
    bool in = true;
    for (std::size_t k = 0; k < 3; ++k) in = in && c[k] >= windows[k][0] && c[k] <= windows[k][1];
    if (!in) continue;
    inside.emplace_back(c[0], c[1], c[2]);
    mean += inside.back();
  }
  if (inside.empty()) return Eigen::Matrix3d::Identity();
  mean /= static_cast<double>(inside.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& c : inside) scatter += (c - mean) * (c - mean).transpose();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvectors();
}

}  // namespace

NetworkView widest_view(const Problem& problem) {
  NetworkView out;
  const std::vector<Vector3<double>> centers = centers_of(problem);
  if (centers.empty()) return out;
  const Eigen::Matrix3d axes = principal_axes(centers);
  std::array<std::vector<double>, 2> values;
  for (const auto& c : centers)
    for (std::size_t k = 0; k < 2; ++k)  // eigenvalues ascend: the last axes are the widest
      values[k].push_back(axes.col(2 - static_cast<int>(k)).dot(Eigen::Vector3d(c[0], c[1], c[2])));
  const std::array<std::array<double, 2>, 2> windows = {window(values[0]), window(values[1])};
  const double width =
      std::max({windows[0][1] - windows[0][0], windows[1][1] - windows[1][0], 1e-300});
  out.aspect = (windows[1][1] - windows[1][0]) / width;
  for (std::size_t j = 0; j < centers.size(); ++j) {
    std::array<double, 2> place{};
    bool beyond = false;
    for (std::size_t k = 0; k < 2; ++k) {
      const double middle = (windows[k][0] + windows[k][1]) / 2;
      const double at = 0.5 + (values[k][j] - middle) / width;
      beyond = beyond || !(at >= 0 && at <= 1);
      place[k] = std::isfinite(at) ? std::clamp(at, 0.0, 1.0) : 0;
    }
    out.beyond += beyond;
    out.places.push_back(place);
  }
  return out;
}

}  // namespace sheaf
