// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/scene_view.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/camera_model.h"

namespace sheaf {
namespace {

double dot(const Vector3<double>& a, const Vector3<double>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector3<double> plus(const Vector3<double>& a, const Vector3<double>& b, double times) {
  return {a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]};
}
double norm(const Vector3<double>& a) { return std::sqrt(dot(a, a)); }
Vector3<double> unit(const Vector3<double>& a, const Vector3<double>& instead) {
  const double n = norm(a);
  return n > 1e-12 && std::isfinite(n) ? Vector3<double>{a[0] / n, a[1] / n, a[2] / n} : instead;
}

/// The row of cam_from_world that an axis of the camera is in the world.
Vector3<double> axis(const Matrix3<double>& R, std::size_t row) {
  return {R[3 * row], R[3 * row + 1], R[3 * row + 2]};
}

/// The direction that these stand most upright to, near a first guess: the eigenvector of least
/// eigenvalue of sum x x^T / n + k (1 - u u^T), by inverse iteration on a shifted matrix.
Vector3<double> upright(const PageScene& scene, const Vector3<double>& guess) {
  constexpr double kNear = 0.03;
  const auto n = static_cast<double>(std::max<std::size_t>(1, scene.num_images()));
  Matrix3<double> M{};
  for (const Matrix3<double>& R : scene.after.rotation)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) M[3 * i + j] += R[i] * R[j] / n;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      M[3 * i + j] += kNear * ((i == j ? 1 : 0) - guess[i] * guess[j]);
  // Eigenvalues are at most 1 + k, so that those of 2 - M are above 0 and its largest is sought.
  Vector3<double> u = guess;
  for (int step = 0; step < 2000; ++step) {
    const Vector3<double> next =
        unit(plus({2 * u[0], 2 * u[1], 2 * u[2]}, multiply(M, u), -1), guess);
    const double change = norm(plus(next, u, -1));
    u = next;
    if (change < 1e-12) break;
  }
  return dot(u, guess) < 0 ? Vector3<double>{-u[0], -u[1], -u[2]} : u;
}

Vector3<double> mean_axis(const PageScene& scene, std::size_t row) {
  Vector3<double> sum{};
  for (const Matrix3<double>& R : scene.after.rotation) sum = plus(sum, axis(R, row), 1);
  const auto n = static_cast<double>(std::max<std::size_t>(1, scene.num_images()));
  return {sum[0] / n, sum[1] / n, sum[2] / n};
}

/// Where the reader looks: as the images do, or, where they look all round, across their path.
Vector3<double> view_direction(const PageScene& scene, const Vector3<double>& up) {
  Vector3<double> look = mean_axis(scene, 2);
  const double agreement = norm(look);
  look = plus(look, up, -dot(look, up));
  if (agreement < 0.5 && scene.num_images() > 1) {
    Vector3<double> mean{}, along{1, 0, 0};
    for (const auto& c : scene.after.centre) mean = plus(mean, c, 1 / double(scene.num_images()));
    double best = -1;
    for (const auto& c : scene.after.centre) {
      const Vector3<double> d = plus(c, mean, -1);
      if (dot(d, d) > best) best = dot(d, d), along = d;
    }
    look = cross(up, plus(along, up, -dot(along, up)));
  }
  const Vector3<double> other =
      std::abs(up[0]) < 0.9 ? Vector3<double>{1, 0, 0} : Vector3<double>{0, 1, 0};
  return unit(look, unit(cross(up, other), {0, 0, 1}));
}

double part(std::vector<double>& values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(share * double(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[std::size_t(at)];
}

void find_box(const PageScene& scene, SceneView& view) {
  std::array<std::vector<double>, 3> shown;
  const std::size_t step = std::max<std::size_t>(1, scene.num_points() / 200000);
  for (std::size_t p = 0; p < scene.num_points(); p += step) {
    const Vector3<double> at = view(result_point(scene, p));
    for (std::size_t k = 0; k < 3; ++k) shown[k].push_back(at[k]);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    if (!shown[k].empty()) low = part(shown[k], 0.03), high = part(shown[k], 0.97);
    for (const Vector3<double>& c : scene.after.centre) {
      low = std::min(low, view(c)[k]);
      high = std::max(high, view(c)[k]);
    }
    if (!(low < high)) low = std::isfinite(low) ? low - 1 : -1, high = low + 2;
    view.core[0][k] = low;
    view.core[1][k] = high;
    view.centre[k] = (low + high) / 2;
  }
  view.radius = norm(plus(view.core[1], view.core[0], -1)) / 2;
  view.reach = 5 * view.radius;
  for (std::size_t p = 0; p < scene.num_points(); ++p) {
    const Vector3<double> d = plus(view(result_point(scene, p)), view.centre, -1);
    view.far += std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])}) > view.reach;
  }
}

/// Half the middle distance from an image to its neighbour, within what can be seen.
double frustum_depth(const PageScene& scene, double radius) {
  constexpr std::size_t kMost = 400;
  const std::vector<Vector3<double>>& c = scene.after.centre;
  const std::size_t step = std::max<std::size_t>(1, c.size() / kMost);
  std::vector<double> nearest;
  for (std::size_t i = 0; i < c.size(); i += step) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < c.size(); ++j)
      if (j != i) least = std::min(least, norm(plus(c[i], c[j], -1)));
    if (std::isfinite(least) && least > 0) nearest.push_back(least);
  }
  const double typical = nearest.empty() ? radius : part(nearest, 0.5);
  return std::clamp(0.45 * typical, 0.02 * radius, 0.09 * radius);
}

}  // namespace

Vector3<double> SceneView::operator()(const Vector3<double>& world) const {
  return multiply(axes, plus(world, origin, -1));
}

Vector3<double> result_point(const PageScene& scene, std::size_t point) {
  const double* X = &scene.result.points[3 * point];
  return {X[0], X[1], X[2]};
}

Vector3<double> start_point(const PageScene& scene, std::size_t point) {
  if (!scene.has_start || !scene.start_point[point]) return result_point(scene, point);
  const double* X = &scene.start.points[3 * point];
  return scene.onto_result({X[0], X[1], X[2]});
}

SceneView scene_view(const PageScene& scene, const Vector3<double>& up) {
  SceneView view;
  Vector3<double> upward = up;
  if (norm(up) == 0) {
    Vector3<double> guess = mean_axis(scene, 1);
    guess = unit({-guess[0], -guess[1], -guess[2]}, {0, -1, 0});
    upward = upright(scene, guess);
  }
  const Vector3<double> look = view_direction(scene, upward), right = cross(look, upward);
  view.axes = {right[0],  right[1], right[2], upward[0], upward[1],
               upward[2], -look[0], -look[1], -look[2]};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (std::size_t p = 0; p < scene.num_points(); ++p)
      values.push_back(scene.result.points[3 * p + k]);
    for (const Vector3<double>& c : scene.after.centre)
      if (scene.num_points() == 0) values.push_back(c[k]);
    view.origin[k] = part(values, 0.5);
  }
  find_box(scene, view);
  view.frustum = frustum_depth(scene, view.radius);
  return view;
}

Frustum frustum(const PageScene& scene, const SceneView& view, std::size_t image, bool start) {
  const bool moved_there = start && scene.has_start && scene.start_image[image];
  const StateNumbers& state = moved_there ? scene.before : scene.after;
  const Problem& problem = moved_there ? scene.start : scene.result;
  const Similarity& onto = scene.onto_result;
  const Camera& camera = problem.cameras[problem.image_camera[image]];
  const ImageFrame& frame = scene.frames[image];
  const double f = std::max(1e-9, std::abs(pixels_per_radian(camera)));
  const double tan_x = frame.half[0] / f, tan_y = frame.half[1] / f;
  // Wide lenses would cover the scene, long ones vanish: sizes vary less than angles do.
  const double size =
      view.frustum * 0.55 / std::clamp(std::sqrt(std::max(1e-12, tan_x * tan_y)), 0.35, 3.0);
  const Matrix3<double>& R = state.rotation[image];
  const Vector3<double> centre = moved_there ? onto(state.centre[image]) : state.centre[image];
  const Matrix3<double> turn = matrix_from_quaternion(onto.rotation);
  Frustum out;
  out[0] = view(centre);
  static constexpr std::array<std::array<double, 2>, 4> kCorners = {
      {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector3<double> d = {kCorners[k][0] * std::min(tan_x, 3.0) * size,
                               kCorners[k][1] * std::min(tan_y, 3.0) * size, size};
    Vector3<double> ray{};
    for (std::size_t j = 0; j < 3; ++j) ray[j] = R[j] * d[0] + R[3 + j] * d[1] + R[6 + j] * d[2];
    if (moved_there) ray = multiply(turn, ray);
    out[k + 1] = view(plus(centre, ray, 1));
  }
  return out;
}

}  // namespace sheaf
