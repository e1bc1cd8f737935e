// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/patch_level.h"

#include <algorithm>
#include <cmath>

#include "geometry/rotation.h"

namespace sheaf {
namespace {

Taps taps_of(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::bilinear:
      return Taps::bilinear_central;
    case Interpolation::bilinear_exact:
      return Taps::bilinear;
    case Interpolation::bicubic:
      break;
  }
  return Taps::catmull_rom;
}

GreyPlane plane_of_level(const GreyImage& image, int level) {
  if (level == 0) return {image.width, image.height, image.pixels.data()};
  int width = image.width, height = image.height;
  std::vector<float> pixels = image.pixels;
  for (int l = 0; l < level; ++l, width /= 2, height /= 2)
    pixels = halve(width, height, pixels.data());
  return {width, height, pixels.data()};
}

/// Patches as their hosts show them; patches that reach beyond the border repeat it.
void take_references(const PhotometricProblem& problem, const Pattern& pattern, int level,
                     PatchScene& scene) {
  const std::size_t cells = scene.grid.cells();
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    double x = problem.host_xy[2 * i], y = problem.host_xy[2 * i + 1];
    for (int l = 0; l < level; ++l) x = halved(x), y = halved(y);
    const GreyPlane& plane = scene.planes[problem.host[i]];
    for (std::size_t k = 0; k < pattern.size(); ++k) {
      const double u = std::clamp(x + pattern.dx[k], -1.0, double(plane.width()));
      const double v = std::clamp(y + pattern.dy[k], -1.0, double(plane.height()));
      scene.references[cells * i + scene.grid.place[k]] =
          static_cast<float>(sample(plane, scene.taps, u, v).value);
    }
  }
}

}  // namespace

bool uses_rays(const PhotometricProblem& problem, const PhotometricOptions& options) {
  return options.parametrisation == Parametrisation::automatic
             ? problem.has_hosts()
             : options.parametrisation == Parametrisation::inverse_depth;
}

PatchScene scene_of_level(const PhotometricProblem& problem, const PhotometricOptions& options,
                          const Pattern& pattern, int level) {
  PatchScene scene;
  Pinhole& k = scene.camera = problem.camera;
  for (int l = 0; l < level; ++l) k = {k.fx / 2, k.fy / 2, halved(k.cx), halved(k.cy)};
  for (const GreyImage& image : problem.images)
    scene.planes.push_back(plane_of_level(image, level));
  scene.grid = make_grid(pattern);
  scene.taps = taps_of(options.interpolation);
  const std::size_t cells = scene.grid.cells(), pixels = pattern.size();
  scene.references.assign(cells * problem.num_points(), 0);
  if (!uses_rays(problem, options)) {
    for (std::size_t i = 0; i < problem.num_points(); ++i)
      for (std::size_t p = 0; p < pixels; ++p)
        scene.references[cells * i + scene.grid.place[p]] = problem.patches[pixels * i + p];
    return scene;
  }
  take_references(problem, pattern, level, scene);
  scene.host = problem.host;
  scene.warped = options.warp != Warp::translation;
  scene.rays = rays_of(problem);
  return scene;
}

std::vector<double> rays_of(const PhotometricProblem& problem) {
  std::vector<double> rays;
  rays.reserve(3 * problem.num_points());
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    for (double c : {(problem.host_xy[2 * i] - problem.camera.cx) / problem.camera.fx,
                     (problem.host_xy[2 * i + 1] - problem.camera.cy) / problem.camera.fy, 1.0})
      rays.push_back(c);
  return rays;
}

PatchState state_of(const PhotometricProblem& problem, bool rays) {
  PatchState state{problem.poses, problem.brightness, problem.points};
  state.brightness.resize(problem.poses.size());
  if (!rays) return state;
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    const Pose& host = problem.poses[problem.host[i]];
    double* X = &state.points[3 * i];
    const Vector3<double> P =
        multiply(matrix_from_quaternion(host.rotation), Vector3<double>{X[0], X[1], X[2]});
    X[0] = 1 / (P[2] + host.translation[2]);
    X[1] = X[2] = 0;
  }
  return state;
}

void store_state(const PatchState& state, bool rays, PhotometricProblem& problem) {
  problem.poses = state.poses;
  problem.brightness = state.brightness;
  if (!rays) {
    problem.points = state.points;
    return;
  }
  const Pinhole& k = problem.camera;
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    const Pose& host = state.poses[problem.host[i]];
    const Matrix3<double> R = matrix_from_quaternion(host.rotation);
    const double depth = 1 / state.points[3 * i];
    const Vector3<double> P{
        (problem.host_xy[2 * i] - k.cx) / k.fx * depth - host.translation[0],
        (problem.host_xy[2 * i + 1] - k.cy) / k.fy * depth - host.translation[1],
        depth - host.translation[2]};
    for (int d = 0; d < 3; ++d)
      problem.points[3 * i + d] = R[d] * P[0] + R[3 + d] * P[1] + R[6 + d] * P[2];
  }
}

std::vector<Sight> all_sights(const PhotometricProblem& problem, bool rays) {
  std::vector<Sight> sights;
  for (std::size_t k = 0; k < problem.sight_point.size(); ++k)
    if (!rays || problem.host[problem.sight_point[k]] != problem.sight_image[k])
      sights.push_back({problem.sight_point[k], problem.sight_image[k]});
  if (!problem.sight_point.empty()) return sights;
  for (std::uint32_t i = 0; i < problem.num_points(); ++i)
    for (std::uint32_t j = 0; j < problem.images.size(); ++j)
      if (!rays || problem.host[i] != j) sights.push_back({i, j});
  return sights;
}

double correlation(const PatchScene& scene, const PatchState& state, const Sight& sight) {
  std::vector<double> residuals;
  if (!patch_residuals(scene, state, sight, residuals)) return -1;
  const Brightness look = relative_brightness(scene, state, sight);
  const float* g = &scene.references[scene.grid.cells() * sight.point];
  double a = 0, b = 0, aa = 0, ab = 0, bb = 0;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const double grey = g[scene.grid.place[k]];
    const double seen = residuals[k] + look.a * grey + look.b;
    a += grey, b += seen, aa += grey * grey, ab += grey * seen, bb += seen * seen;
  }
  const double n = static_cast<double>(residuals.size());
  const double va = aa - a * a / n, vb = bb - b * b / n;
  return va > 1e-9 && vb > 1e-9 ? (ab - a * b / n) / std::sqrt(va * vb) : 0;
}

}  // namespace sheaf
