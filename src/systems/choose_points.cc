// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/choose_points.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>

#include "geometry/camera_model.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// At least so many of many points.
constexpr std::size_t kLookedAt = 1024;
constexpr double kEnough = 0.02;
/// Where the camera all but rotates alone no depth is known, and there is no side to keep to.
constexpr double kMostly = 0.5;

/// Whether the angle between two rays is at least the one that has this tangent, below a right one;
/// infinite: no angle is.
bool is_apart(const Vector3<double>& a, const Vector3<double>& b, double tangent) {
  const Vector3<double> c = cross(a, b);
  const double along = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  if (std::isinf(tangent)) return false;
  const double across2 = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
  if (!(along > 0)) return along < 0 || across2 > 0;
  return across2 >= tangent * tangent * along * along;
}

/// Of the angle under which so many pixels are seen; infinite where that is a right one or more.
double tangent_of(const Camera& camera, double pixels) {
  constexpr double kRight = 1.5707963267948966;
  const double f = std::fabs(pixels_per_radian(camera));
  return pixels < kRight * f ? std::tan(pixels / f) : std::numeric_limits<double>::infinity();
}

}  // namespace

double share_of_small_parallax(const Problem& problem, const std::vector<std::uint8_t>& skip,
                               double parallax_px, ParallaxScratch& scratch) {
  const std::size_t stride =
      std::bit_floor(std::max<std::size_t>(1, problem.num_points() / kLookedAt));
  auto& looked = scratch.looked;
  auto& centres = scratch.centres;
  scratch.tangents.clear();
  for (const Camera& camera : problem.cameras)
    scratch.tangents.push_back(tangent_of(camera, parallax_px));
  looked.assign(problem.num_points() / stride + 1, {});
  centres.clear();
  centres.reserve(problem.num_images());
  for (const Pose& pose : problem.poses)
    centres.push_back(camera_centre(matrix_from_quaternion(pose.rotation), pose));
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::size_t point = problem.observation_point[i];
    if ((point & (stride - 1)) != 0 || (!skip.empty() && skip[i] != 0)) continue;
    const std::size_t image = problem.observation_image[i];
    Vector3<double> ray;
    for (std::size_t k = 0; k < 3; ++k) ray[k] = problem.points[3 * point + k] - centres[image][k];
    ParallaxScratch::Looked& at = looked[point / stride];
    if (at.rays++ == 0) {
      at.first = ray;
      continue;
    }
    if (!at.large)
      at.large = is_apart(at.first, ray, scratch.tangents[problem.image_camera[image]]);
  }
  std::size_t seen = 0, small = 0;
  for (const auto& at : looked) {
    if (at.rays < 2) continue;
    ++seen;
    small += !at.large;
  }
  return seen > 0 ? static_cast<double>(small) / static_cast<double>(seen) : 0;
}

namespace {

void choose(PointParametrisation points, bool crosses, const char* reason, PointChoice& out) {
  out.points = points;
  out.crosses = crosses;
  out.reason.assign(reason);
}

}  // namespace

bool asks_for_parallax(const SolveOptions& options, PointChoice& out) {
  const bool crosses = options.cheirality == Cheirality::formula;
  if (options.points != PointParametrisation::automatic)
    choose(options.points, crosses, "as asked", out);
  else if (options.fixed.points)
    choose(PointParametrisation::xyz, crosses, "points are held", out);
  else if (options.trust_region == TrustRegion::dogleg)
    choose(PointParametrisation::xyz, crosses, "the dogleg knows no other", out);
  else
    return true;
  return false;
}

void choose_by_parallax(double share, const SolveOptions& options, PointChoice& out) {
  const bool crosses = options.cheirality == Cheirality::formula;
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.2g %% of the points have a parallax below %.0f px",
                100 * share, kSmallParallax_px);
  if (options.loss.kind != LossKind::none && share < kMostly)
    return choose(PointParametrisation::xyz, crosses, "a loss is quicker with them", out);
  if (share < kEnough) return choose(PointParametrisation::xyz, crosses, text.data(), out);
  choose(PointParametrisation::inverse_depth, crosses && share >= kMostly, text.data(), out);
}

void choose_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                   const SolveOptions& options, ParallaxScratch& scratch, PointChoice& out) {
  if (asks_for_parallax(options, out))
    choose_by_parallax(share_of_small_parallax(problem, skip, kSmallParallax_px, scratch), options,
                       out);
}

PointChoice choose_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                          const SolveOptions& options) {
  ParallaxScratch scratch;
  PointChoice out;
  choose_points(problem, skip, options, scratch, out);
  return out;
}

}  // namespace sheaf
