// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/depth_points.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/rotation.h"

namespace sheaf {
namespace {

constexpr int kMargin_px = 8;        ///< points keep away from the border
constexpr int kAround_px = 2;        ///< how far around a point its depth must be smooth
constexpr double kSmooth = 0.02;     ///< relative, over that distance
constexpr double kTargetMargin = 2;  ///< px: what a patch in another image needs at least

struct Candidate {
  std::uint32_t image;
  int x, y;
  double slope2;
};

double slope2_at(const GreyImage& image, int x, int y) {
  const auto grey = [&](int u, int v) {
    return double(image.pixels[std::size_t(v) * std::size_t(image.width) + std::size_t(u)]);
  };
  const double dx = (grey(x + 1, y) - grey(x - 1, y)) / 2;
  const double dy = (grey(x, y + 1) - grey(x, y - 1)) / 2;
  return dx * dx + dy * dy;
}

/// No edge of an object: there a patch shows two surfaces.
bool is_smooth(const DepthMap& map, int x, int y) {
  const double middle = map.at(x, y);
  if (!(middle > 0)) return false;
  for (int v = y - kAround_px; v <= y + kAround_px; ++v)
    for (int u = x - kAround_px; u <= x + kAround_px; ++u)
      if (!(std::abs(map.at(u, v) - middle) <= kSmooth * middle)) return false;
  return true;
}

Candidate best_of_cell(const GreyImage& image, const DepthMap& map, int left, int top, int cell) {
  Candidate best{0, 0, 0, 0};
  for (int y = top; y < std::min(top + cell, image.height - kMargin_px); ++y)
    for (int x = left; x < std::min(left + cell, image.width - kMargin_px); ++x) {
      const double slope2 = slope2_at(image, x, y);
      if (slope2 > best.slope2 && is_smooth(map, x, y)) best = {0, x, y, slope2};
    }
  return best;
}

std::vector<Candidate> candidates(const PhotometricProblem& problem,
                                  const std::vector<DepthMap>& maps, const DepthPointRules& rules) {
  std::vector<Candidate> out;
  for (std::uint32_t i = 0; i < problem.images.size(); ++i) {
    const GreyImage& image = problem.images[i];
    for (int top = kMargin_px; top < image.height - kMargin_px; top += rules.cell_px)
      for (int left = kMargin_px; left < image.width - kMargin_px; left += rules.cell_px) {
        Candidate best = best_of_cell(image, maps[i], left, top, rules.cell_px);
        best.image = i;
        if (best.slope2 > 0 && best.slope2 >= rules.least_slope * rules.least_slope)
          out.push_back(best);
      }
  }
  return out;
}

/// Those with the steepest slopes, in the order in which they were found.
void keep_steepest(std::size_t most, std::vector<Candidate>& all) {
  if (all.size() <= most) return;
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return all[a].slope2 > all[b].slope2; });
  order.resize(most);
  std::sort(order.begin(), order.end());
  std::vector<Candidate> kept;
  for (std::size_t k : order) kept.push_back(all[k]);
  all = std::move(kept);
}

Vector3<double> in_camera(const Pose& pose, const double* X) {
  Vector3<double> P =
      multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{X[0], X[1], X[2]});
  for (int d = 0; d < 3; ++d) P[d] += pose.translation[d];
  return P;
}

bool sees(const PhotometricProblem& problem, const DepthMap& map, std::size_t image,
          std::size_t point, double tolerance) {
  const Vector3<double> P = in_camera(problem.poses[image], &problem.points[3 * point]);
  if (!(P[2] > 0)) return false;
  const double x = problem.camera.fx * P[0] / P[2] + problem.camera.cx;
  const double y = problem.camera.fy * P[1] / P[2] + problem.camera.cy;
  if (!(x >= kTargetMargin && y >= kTargetMargin && x <= map.width - 1 - kTargetMargin &&
        y <= map.height - 1 - kTargetMargin))
    return false;
  const double depth = map.at(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  return depth > 0 && std::abs(depth - P[2]) <= tolerance * P[2];
}

}  // namespace

void place_on_ray(PhotometricProblem& problem, std::size_t point, double depth) {
  const Pose& pose = problem.poses[problem.host[point]];
  const Pinhole& k = problem.camera;
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  const double P[3] = {depth * (problem.host_xy[2 * point] - k.cx) / k.fx - pose.translation[0],
                       depth * (problem.host_xy[2 * point + 1] - k.cy) / k.fy - pose.translation[1],
                       depth - pose.translation[2]};
  for (int d = 0; d < 3; ++d)
    problem.points[3 * point + d] = R[d] * P[0] + R[3 + d] * P[1] + R[6 + d] * P[2];
}

double depth_in(const PhotometricProblem& problem, std::size_t point, std::size_t image) {
  return in_camera(problem.poses[image], &problem.points[3 * point])[2];
}

void choose_points(const std::vector<DepthMap>& maps, const DepthPointRules& rules,
                   PhotometricProblem& problem) {
  std::vector<Candidate> chosen = candidates(problem, maps, rules);
  keep_steepest(rules.most, chosen);
  problem.points.assign(3 * chosen.size(), 0);
  problem.host.clear();
  problem.host_xy.clear();
  for (const Candidate& at : chosen) {
    problem.host.push_back(at.image);
    problem.host_xy.insert(problem.host_xy.end(), {double(at.x), double(at.y)});
    place_on_ray(problem, problem.host.size() - 1, maps[at.image].at(at.x, at.y));
  }
}

void find_sights(const std::vector<DepthMap>& maps, double depth_tolerance,
                 PhotometricProblem& problem) {
  problem.sight_point.clear();
  problem.sight_image.clear();
  for (std::uint32_t i = 0; i < problem.num_points(); ++i)
    for (std::uint32_t j = 0; j < problem.images.size(); ++j) {
      if (problem.host[i] == j || !sees(problem, maps[j], j, i, depth_tolerance)) continue;
      problem.sight_point.push_back(i);
      problem.sight_image.push_back(j);
    }
}

}  // namespace sheaf
