// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/textbook.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/camera_model.h"
#include "reduced/scaling.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

Vector3<double> centre(const Pose& pose) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Vector3<double> C{};
  for (int k = 0; k < 3; ++k)
    for (int r = 0; r < 3; ++r) C[k] -= R[3 * r + k] * pose.translation[r];
  return C;
}

}  // namespace

Places::Places(const Problem& p, const Fixed& fixed) {
  const auto free = [](const std::vector<std::uint32_t>& ids, std::size_t i) {
    return std::find(ids.begin(), ids.end(), i) == ids.end();
  };
  for (std::size_t i = 0; i < p.num_images(); ++i)
    for (int k = 0; k < 6; ++k)
      pose.push_back(!fixed.poses && free(fixed.pose_ids, i) ? count++ : -1);
  const std::vector<ParameterSet> held = held_parameters(p, fixed);
  for (std::size_t i = 0; i < p.cameras.size(); ++i)
    for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
      lens.push_back(k < parameter_count(p.cameras[i].model) && (held[i] >> k & 1) == 0 ? count++
                                                                                        : -1);
  for (std::size_t i = 0; i < p.points.size(); ++i) point.push_back(fixed.points ? -1 : count++);
}

Charts::Charts(const Problem& p, PointParametrisation points) : host(p.num_points(), UINT32_MAX) {
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    host[p.observation_point[i]] = std::min(host[p.observation_point[i]], p.observation_image[i]);
  const auto images = static_cast<double>(p.num_images());
  for (const Pose& pose : p.poses)
    for (int k = 0; k < 3; ++k) rules.origin[k] += centre(pose)[k] / images;
  double length = 0;
  for (const Pose& pose : p.poses) {
    const Vector3<double> C = centre(pose), O = rules.origin;
    length += std::hypot(C[0] - O[0], C[1] - O[1], C[2] - O[2]) / images;
  }
  rules.unit = towards_one(length);
  if (points == PointParametrisation::homogeneous) rules.base = ChartBase::origin;
  if (points == PointParametrisation::inverse_depth) rules.base = ChartBase::host;
}

Vector3<double> Charts::base(const Problem& p, std::size_t point) const {
  return rules.base == ChartBase::host ? centre(p.poses[host[point]]) : rules.origin;
}

PointChart<double> Charts::at(const Problem& p, std::size_t point) const {
  const Vector3<double> C = base(p, point);
  const double* X = &p.points[3 * point];
  return {rules, {X[0] - C[0], X[1] - C[1], X[2] - C[2]}};
}

Normal::Normal(const Problem& p, const Places& at, const ScaledLoss& loss, const Charts& charts)
    : A(static_cast<std::size_t>(at.count) * at.count), b(at.count) {
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    const std::size_t image = p.observation_image[i], point = p.observation_point[i];
    const std::size_t lens = p.image_camera[image];
    const Matrix3<double> R = matrix_from_quaternion(p.poses[image].rotation);
    const double* X = &p.points[3 * point];
    Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
    for (int k = 0; k < 3; ++k) P[k] += p.poses[image].translation[k];
    const LensJacobian<double> j = project_with_jacobian(p.cameras[lens], P);
    const double by = p.observation_sigma.empty() ? 1 : 1 / p.observation_sigma[i];
    const auto e = residual(p.cameras[lens], j.pixel, &p.observation_xy[2 * i]);
    const double r[2] = {by * e[0], by * e[1]};
    const LossValue<double> rho = evaluate_loss(loss, r[0] * r[0] + r[1] * r[1]);
    cost += rho.value / 2;
    const double w = std::sqrt(rho.first);
    for (int row = 0; row < 2; ++row) {
      std::vector<std::pair<int, double>> entries;
      Vector3<double> a = j.point[row];
      for (double& x : a) x *= by;
      const Vector3<double> turn = cross(P, a);
      Vector3<double> by_point{};
      for (int c = 0; c < 3; ++c) {
        entries.emplace_back(at.pose[6 * image + c], w * a[c]);
        entries.emplace_back(at.pose[6 * image + 3 + c], w * turn[c]);
        for (int k = 0; k < 3; ++k) by_point[c] += a[k] * R[3 * k + c];
      }
      for (std::size_t c = 0; c < kMaxCameraParameters; ++c)
        if (const int place = at.lens[kMaxCameraParameters * lens + c]; place >= 0)
          entries.emplace_back(place, w * by * j.parameters[row][c]);
      if (charts.rules.base != ChartBase::none) by_point = charts.at(p, point).transpose(by_point);
      for (int c = 0; c < 3; ++c) entries.emplace_back(at.point[3 * point + c], w * by_point[c]);
      add_row(entries, w * r[row]);
    }
  }
}

void Normal::add_row(const std::vector<std::pair<int, double>>& entries, double r) {
  for (const auto& [a, va] : entries) {
    if (a < 0) continue;
    b[a] -= va * r;
    for (const auto& [c, vc] : entries)
      if (c >= 0) A[a * b.size() + c] += va * vc;
  }
}

std::vector<double> solve_dense(std::vector<double> A, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t r = k + 1; r < n; ++r) {
      const double f = A[r * n + k] / A[k * n + k];
      if (f == 0) continue;
      for (std::size_t c = k; c < n; ++c) A[r * n + c] -= f * A[k * n + c];
      b[r] -= f * b[k];
    }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t c = k + 1; c < n; ++c) b[k] -= A[k * n + c] * b[c];
    b[k] /= A[k * n + k];
  }
  return b;
}

namespace {

/// The coordinates q of a point in its chart, whose base moves with the image it is about.
void move_in_chart(const Problem& before, const Charts& charts, std::size_t point,
                   const Vector3<double>& q, Problem& p) {
  const Vector3<double> C = charts.base(before, point), moved = charts.base(p, point);
  const PointChart<double> chart = charts.at(before, point);
  Vector3<double> d = chart.apply(q);
  for (int k = 0; k < 3; ++k) d[k] -= moved[k] - C[k];
  const Vector3<double> Y = chart.retract(charts.rules, d);
  for (int k = 0; k < 3; ++k) p.points[3 * point + k] = moved[k] + Y[k];
}

}  // namespace

void move(Problem& p, const Places& at, const std::vector<double>& x, const Charts& charts) {
  const Problem before = p;
  const auto step = [&](int place) { return place < 0 ? 0 : x[place]; };
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    Vector3<double> rho, phi;
    for (int k = 0; k < 3; ++k) rho[k] = step(at.pose[6 * i + k]);
    for (int k = 0; k < 3; ++k) phi[k] = step(at.pose[6 * i + 3 + k]);
    const auto moved =
        left_perturbed(RigidMotion<double>{p.poses[i].rotation, p.poses[i].translation}, rho, phi);
    p.poses[i] = {moved.rotation, moved.translation};
  }
  for (std::size_t i = 0; i < at.lens.size(); ++i)
    p.cameras[i / kMaxCameraParameters].parameters[i % kMaxCameraParameters] += step(at.lens[i]);
  for (std::size_t i = 0; i < p.num_points() && at.point[3 * i] >= 0; ++i) {
    const Vector3<double> q{x[at.point[3 * i]], x[at.point[3 * i + 1]], x[at.point[3 * i + 2]]};
    if (charts.rules.base != ChartBase::none)
      move_in_chart(before, charts, i, q, p);
    else
      for (int k = 0; k < 3; ++k) p.points[3 * i + k] += q[k];
  }
}

Problem first_points(const Problem& p, std::uint32_t points) {
  Problem out = p;
  out.points.resize(3 * points);
  out.observation_image.clear();
  out.observation_point.clear();
  out.observation_xy.clear();
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (p.observation_point[i] < points)
      out.add_observation(p.observation_image[i], p.observation_point[i], p.observation_xy[2 * i],
                          p.observation_xy[2 * i + 1]);
  return out;
}

void expect_textbook_step(const Problem& start, const Fixed& fixed, double damping,
                          const Loss& loss, PointParametrisation points, CameraSolverKind solver) {
  const Places at(start, fixed);
  const Charts charts(start, points);
  const ScaledLoss scaled{loss.kind, loss.scale_px};
  const Normal normal(start, at, scaled, charts);
  const std::size_t n = normal.b.size();
  std::vector<double> A = normal.A, D(n);
  for (std::size_t i = 0; i < n; ++i) {
    D[i] = damping * std::clamp(A[i * n + i], 1e-6, 1e32);
    A[i * n + i] += D[i];
  }
  const std::vector<double> x = solve_dense(A, normal.b);
  double linear = 0, quadratic = 0;
  for (std::size_t i = 0; i < n; ++i) {
    linear += normal.b[i] * x[i];
    for (std::size_t j = 0; j < n; ++j) quadratic += x[i] * normal.A[i * n + j] * x[j];
  }
  const double predicted = linear - quadratic / 2;  // by definition: cost - 1/2 |r + J x|^2
  Problem stepped = start;
  move(stepped, at, x, charts);
  const double trial = robust_cost(stepped, scaled);

  Problem problem = start;
  SolveOptions options;
  options.fixed = fixed;
  options.initial_damping = damping;
  options.loss = loss;
  options.points = points;
  options.inner_iterations = 0;  // the textbook has none
  options.max_iterations = 1;
  options.gradient_tolerance = 0;
  options.solver = solver;
  const Summary s = solve(problem, options);
  ASSERT_EQ(s.iterations.size(), 2u);
  const Iteration& it = s.iterations[1];
  EXPECT_NEAR(s.initial_cost, normal.cost, 1e-12 * normal.cost);
  EXPECT_NEAR(it.trial_cost, trial, 1e-7 * trial);
  const double ours = (s.initial_cost - it.trial_cost) / it.gain_ratio;
  EXPECT_NEAR(ours, predicted, 1e-8 * predicted);
  if (!it.accepted) return;
  for (std::size_t i = 0; i < start.points.size(); ++i)
    EXPECT_NEAR(problem.points[i], stepped.points[i], 1e-6 * (1 + std::abs(stepped.points[i])));
  for (std::size_t i = 0; i < start.cameras.size(); ++i)
    for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
      EXPECT_NEAR(problem.cameras[i].parameters[k], stepped.cameras[i].parameters[k],
                  1e-6 * (1e-3 + std::abs(stepped.cameras[i].parameters[k])))
          << "camera " << i << ", " << k;
}

}  // namespace sheaf
