// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/photometric.h"

#include <algorithm>

#include "geometry/rigid_motion.h"

namespace sheaf {
namespace {

using Vector = Vector3<double>;

Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// R^T v.
Vector turn_back(const Matrix3<double>& R, const Vector& v) {
  return {R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
          R[2] * v[0] + R[5] * v[1] + R[8] * v[2]};
}

}  // namespace

PatchPlace place_patch(const PatchScene& scene, const PatchState& state, const Sight& sight, int dx,
                       int dy) {
  const double* X = &state.points[3 * std::size_t(sight.point)];
  const Pose& target = state.poses[sight.image];
  const Matrix3<double> R = matrix_from_quaternion(target.rotation);
  Vector P;
  if (scene.has_rays()) {
    // (ray - s t_host) turned into the world, scaled by the inverse depth s throughout
    const Pose& host = state.poses[scene.host[sight.point]];
    const double* ray = &scene.rays[3 * std::size_t(sight.point)];
    const Vector& t = host.translation;
    const Vector world =
        turn_back(matrix_from_quaternion(host.rotation),
                  minus({ray[0] + dx / scene.camera.fx, ray[1] + dy / scene.camera.fy, ray[2]},
                        {X[0] * t[0], X[0] * t[1], X[0] * t[2]}));
    P = multiply(R, world);
    for (int i = 0; i < 3; ++i) P[i] += X[0] * target.translation[i];
  } else {
    P = multiply(R, {X[0], X[1], X[2]});
    for (int i = 0; i < 3; ++i) P[i] += target.translation[i];
  }
  const Pinhole& k = scene.camera;
  return {k.fx * P[0] / P[2] + k.cx, k.fy * P[1] / P[2] + k.cy, P[2]};
}

Brightness relative_brightness(const PatchScene& scene, const PatchState& state,
                               const Sight& sight) {
  const Brightness& target = state.brightness[sight.image];
  if (scene.host.empty()) return target;
  const Brightness& host = state.brightness[scene.host[sight.point]];
  const double alpha = target.a / host.a;
  return {alpha, target.b - alpha * host.b};
}

bool is_seen(const PatchScene& scene, const PatchState& state, const Sight& sight) {
  const PatchGrid& grid = scene.grid;
  const GreyPlane& plane = scene.planes[sight.image];
  const PatchPlace middle = place_patch(scene, state, sight);
  if (!(middle.depth > 0) || !patch_fits(grid, plane, middle.x, middle.y)) return false;
  if (!scene.warped) return true;
  for (int dx : {grid.left, grid.right()})
    for (int dy : {grid.top, grid.bottom()}) {
      const PatchPlace at = place_patch(scene, state, sight, dx, dy);
      if (!(at.depth > 0) || !pixel_fits(plane, at.x, at.y)) return false;
    }
  return true;
}

bool patch_residuals(const PatchScene& scene, const PatchState& state, const Sight& sight,
                     std::vector<double>& out) {
  if (!is_seen(scene, state, sight)) return false;
  const PatchPlace middle = place_patch(scene, state, sight);
  const GreyPlane& plane = scene.planes[sight.image];
  const Brightness look = relative_brightness(scene, state, sight);
  const PatchGrid& grid = scene.grid;
  const float* g = &scene.references[grid.cells() * sight.point];
  out.resize(grid.place.size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    const std::uint32_t cell = grid.place[k];
    const int dx = static_cast<int>(grid.dx[cell]), dy = static_cast<int>(grid.dy[cell]);
    const PatchPlace at = scene.warped ? place_patch(scene, state, sight, dx, dy)
                                       : PatchPlace{middle.x + dx, middle.y + dy, middle.depth};
    out[k] = sample(plane, scene.taps, at.x, at.y).value - (look.a * g[cell] + look.b);
  }
  return true;
}

PatchGrid make_grid(const Pattern& pattern) {
  PatchGrid grid;
  const auto [left, right] = std::minmax_element(pattern.dx.begin(), pattern.dx.end());
  const auto [top, bottom] = std::minmax_element(pattern.dy.begin(), pattern.dy.end());
  grid.left = *left, grid.top = *top;
  grid.width = *right - *left + 1, grid.rows = *bottom - *top + 1;
  grid.narrow = grid.width <= 4;
  grid.strips = (grid.width + 7) / 8;
  grid.steps = grid.narrow ? (grid.rows + 1) / 2 : grid.rows;
  for (int strip = 0; strip < grid.strips; ++strip)
    for (int step = 0; step < grid.steps; ++step)
      for (int lane = 0; lane < 8; ++lane) {
        const int column = grid.narrow ? lane % 4 : 8 * strip + lane;
        const int row = grid.narrow ? step + grid.steps * (lane / 4) : step;
        grid.dx.push_back(static_cast<float>(grid.left + column));
        grid.dy.push_back(static_cast<float>(grid.top + row));
      }
  grid.mask.assign(grid.dx.size(), 0);
  grid.cell_at.assign(static_cast<std::size_t>(grid.width * grid.rows), -1);
  grid.spot.assign(grid.dx.size(), static_cast<std::uint32_t>(grid.area()));
  for (std::size_t k = 0; k < pattern.size(); ++k)
    for (std::uint32_t cell = 0; cell < grid.cells(); ++cell)
      if (grid.dx[cell] == pattern.dx[k] && grid.dy[cell] == pattern.dy[k]) {
        grid.mask[cell] = 1;
        grid.place.push_back(cell);
        const int row = pattern.dy[k] - grid.top, column = pattern.dx[k] - grid.left;
        const auto spot = static_cast<std::size_t>(grid.width * row + column);
        grid.cell_at[spot] = static_cast<int>(cell);
        grid.spot[cell] = static_cast<std::uint32_t>(spot);
      }
  return grid;
}

}  // namespace sheaf
