// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/choose_points.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdio>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// At least so many of many points.
constexpr std::size_t kLookedAt = 1024;
constexpr double kSmallParallax_px = 20, kEnough = 0.02;
/// Where the camera all but rotates alone no depth is known, and there is no side to keep to.
constexpr double kMostly = 0.5;

/// A point that is looked at: its first ray, and the largest parallax so far.
struct Looked {
  std::uint32_t rays = 0;
  Vector3<double> first{};
  double parallax_px = 0;
};

/// Length of the cross product and dot product give the angle exactly where it is small.
double angle(const Vector3<double>& a, const Vector3<double>& b) {
  const Vector3<double> c = cross(a, b);
  return std::atan2(std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]),
                    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

}  // namespace

double share_of_small_parallax(const Problem& problem, const std::vector<std::uint8_t>& skip,
                               double parallax_px) {
  const std::size_t stride =
      std::bit_floor(std::max<std::size_t>(1, problem.num_points() / kLookedAt));
  std::vector<Looked> looked(problem.num_points() / stride + 1);
  std::vector<Vector3<double>> centres;
  centres.reserve(problem.num_images());
  for (const Pose& pose : problem.poses)
    centres.push_back(camera_centre(matrix_from_quaternion(pose.rotation), pose));
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::size_t point = problem.observation_point[i];
    if ((point & (stride - 1)) != 0 || (!skip.empty() && skip[i] != 0)) continue;
    const std::size_t image = problem.observation_image[i];
    Vector3<double> ray;
    for (std::size_t k = 0; k < 3; ++k) ray[k] = problem.points[3 * point + k] - centres[image][k];
    Looked& at = looked[point / stride];
    if (at.rays++ == 0) {
      at.first = ray;
      continue;
    }
    const Camera& camera = problem.cameras[problem.image_camera[image]];
    at.parallax_px =
        std::max(at.parallax_px, std::fabs(pixels_per_radian(camera)) * angle(at.first, ray));
  }
  std::size_t seen = 0, small = 0;
  for (const Looked& at : looked) {
    if (at.rays < 2) continue;
    ++seen;
    small += at.parallax_px < parallax_px;
  }
  return seen > 0 ? static_cast<double>(small) / static_cast<double>(seen) : 0;
}

PointChoice choose_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                          const SolveOptions& options) {
  const bool crosses = options.cheirality == Cheirality::formula;
  if (options.points != PointParametrisation::automatic)
    return {options.points, crosses, "as asked"};
  if (options.fixed.points) return {PointParametrisation::xyz, crosses, "points are held"};
  if (options.trust_region == TrustRegion::dogleg)
    return {PointParametrisation::xyz, crosses, "the dogleg knows no other"};
  const double share = share_of_small_parallax(problem, skip, kSmallParallax_px);
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.2g %% of the points have a parallax below %.0f px",
                100 * share, kSmallParallax_px);
  if (options.loss.kind != LossKind::none && share < kMostly)
    return {PointParametrisation::xyz, crosses, "a loss is quicker with them"};
  if (share < kEnough) return {PointParametrisation::xyz, crosses, text.data()};
  return {PointParametrisation::inverse_depth, crosses && share >= kMostly, text.data()};
}

}  // namespace sheaf
