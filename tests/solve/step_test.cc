// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// One step of the solver against one step by the textbook: the whole Jacobian as a dense matrix,
// the damped normal equations of cameras and points together, no elimination.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/bal_camera.h"
#include "geometry/point_chart.h"
#include "geometry/rigid_motion.h"
#include "linear/scaling.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

/// Where the parameters of a problem stand in the textbook's vector; -1: held.
struct Places {
  std::vector<int> pose, lens, point;
  int count = 0;

  Places(const Problem& p, const Fixed& fixed) {
    const auto free = [](const std::vector<std::uint32_t>& ids, std::size_t i) {
      return std::find(ids.begin(), ids.end(), i) == ids.end();
    };
    for (std::size_t i = 0; i < p.num_images(); ++i)
      for (int k = 0; k < 6; ++k)
        pose.push_back(!fixed.poses && free(fixed.pose_ids, i) ? count++ : -1);
    const bool held[3] = {fixed.f, fixed.k1, fixed.k2};
    for (std::size_t i = 0; i < p.cameras.size(); ++i)
      for (bool h : held) lens.push_back(!h && free(fixed.camera_ids, i) ? count++ : -1);
    for (std::size_t i = 0; i < p.points.size(); ++i) point.push_back(fixed.points ? -1 : count++);
  }
};

Vector3<double> centre(const Pose& pose) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Vector3<double> C{};
  for (int k = 0; k < 3; ++k)
    for (int r = 0; r < 3; ++r) C[k] -= R[3 * r + k] * pose.translation[r];
  return C;
}

/// The coordinates that the textbook's points step in.
struct Charts {
  ChartRules rules;
  std::vector<std::uint32_t> host;  ///< first image that sees the point

  Charts(const Problem& p, PointParametrisation points) : host(p.num_points(), UINT32_MAX) {
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
  Vector3<double> base(const Problem& p, std::size_t point) const {
    return rules.base == ChartBase::host ? centre(p.poses[host[point]]) : rules.origin;
  }
  PointChart<double> at(const Problem& p, std::size_t point) const {
    const Vector3<double> C = base(p, point);
    const double* X = &p.points[3 * point];
    return {rules, {X[0] - C[0], X[1] - C[1], X[2] - C[2]}};
  }
};

/// A = J^T J and b = -J^T r.
struct Normal {
  std::vector<double> A, b;
  double cost = 0;

  Normal(const Problem& p, const Places& at, const ScaledLoss& loss, const Charts& charts)
      : A(static_cast<std::size_t>(at.count) * at.count), b(at.count) {
    for (std::size_t i = 0; i < p.num_observations(); ++i) {
      const std::size_t image = p.observation_image[i], point = p.observation_point[i];
      const std::size_t lens = p.image_camera[image];
      const auto& k = p.cameras[lens].parameters;
      const auto j = project_with_jacobian<double>(
          matrix_from_quaternion(p.poses[image].rotation), p.poses[image].translation,
          {k[0], k[1], k[2]},
          {p.points[3 * point], p.points[3 * point + 1], p.points[3 * point + 2]});
      const double r[2] = {j.pixel[0] - p.observation_xy[2 * i],
                           j.pixel[1] - p.observation_xy[2 * i + 1]};
      const LossValue<double> rho = evaluate_loss(loss, r[0] * r[0] + r[1] * r[1]);
      cost += rho.value / 2;
      const double w = std::sqrt(rho.first);
      for (int row = 0; row < 2; ++row) {
        std::vector<std::pair<int, double>> entries;
        for (int c = 0; c < 6; ++c)
          entries.emplace_back(at.pose[6 * image + c], w * j.camera[9 * row + c]);
        for (int c = 0; c < 3; ++c)
          entries.emplace_back(at.lens[3 * lens + c], w * j.camera[9 * row + 6 + c]);
        Vector3<double> by_point{j.point[3 * row], j.point[3 * row + 1], j.point[3 * row + 2]};
        if (charts.rules.base != ChartBase::none)
          by_point = charts.at(p, point).transpose(by_point);
        for (int c = 0; c < 3; ++c) entries.emplace_back(at.point[3 * point + c], w * by_point[c]);
        add_row(entries, w * r[row]);
      }
    }
  }

  void add_row(const std::vector<std::pair<int, double>>& entries, double r) {
    for (const auto& [a, va] : entries) {
      if (a < 0) continue;
      b[a] -= va * r;
      for (const auto& [c, vc] : entries)
        if (c >= 0) A[a * b.size() + c] += va * vc;
    }
  }
};

/// Solves A x = b for a symmetric positive definite A, by elimination without pivoting.
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
    p.cameras[i / 3].parameters[i % 3] += step(at.lens[i]);
  for (std::size_t i = 0; i < p.num_points() && at.point[3 * i] >= 0; ++i) {
    const Vector3<double> q{x[at.point[3 * i]], x[at.point[3 * i + 1]], x[at.point[3 * i + 2]]};
    if (charts.rules.base != ChartBase::none)
      move_in_chart(before, charts, i, q, p);
    else
      for (int k = 0; k < 3; ++k) p.points[3 * i + k] += q[k];
  }
}

/// Only what the first `points` points contribute: small enough for the textbook.
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
                          const Loss& loss = {},
                          PointParametrisation points = PointParametrisation::xyz) {
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
    EXPECT_NEAR(problem.cameras[i].parameters[0], stepped.cameras[i].parameters[0],
                1e-6 * std::abs(stepped.cameras[i].parameters[0]));
}

const std::vector<double> kDampings = {1e-4, 1e-2, 1, 100};

Fixed points_held() {
  Fixed fixed;
  fixed.points = true;
  return fixed;
}

TEST(Step, IsTheTextbooks) {
  const Problem problem = first_points(small_scene().start, 40);
  for (double damping : kDampings) expect_textbook_step(problem, {}, damping);
}

TEST(Step, IsTheTextbooksWithPartsHeld) {
  const Problem problem = first_points(small_scene().start, 40);
  Fixed distortion_held, singles;
  distortion_held.k1 = distortion_held.k2 = true;
  singles.pose_ids = {1, 4};
  singles.camera_ids = {2};
  Fixed poses_held;
  poses_held.poses = true;
  for (const Fixed& fixed : {points_held(), distortion_held, singles, poses_held})
    for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
}

TEST(Step, IsTheTextbooksWithALoss) {
  // Half a pixel: at the start most residuals lie beyond it.
  const Problem problem = first_points(small_scene().start, 40);
  for (const Loss& loss : {Loss(Huber{0.5}), Loss(SoftL1{0.5}), Loss(Cauchy{0.5}), Loss(Tukey{30}),
                           Loss(GemanMcClure{0.5})})
    for (const Fixed& fixed : {Fixed(), points_held()})
      for (double damping : kDampings) {
        SCOPED_TRACE(to_string(loss.kind));
        expect_textbook_step(problem, fixed, damping, loss);
      }
}

TEST(Step, IsTheTextbooksInCharts) {
  Problem problem = first_points(small_scene().start, 40);
  const Problem near = problem;
  for (int times : {1, 30})
    for (PointParametrisation points :
         {PointParametrisation::homogeneous, PointParametrisation::inverse_depth}) {
      SCOPED_TRACE(times);
      for (std::size_t i = 0; i < problem.points.size(); ++i)
        problem.points[i] = near.points[i] * (i / 3 % 2 == 0 ? times : 1);
      Fixed singles;
      singles.pose_ids = {1, 4};
      for (double damping : kDampings) {
        expect_textbook_step(problem, {}, damping, {}, points);
        expect_textbook_step(problem, singles, damping, Cauchy{0.5}, points);
        expect_textbook_step(problem, points_held(), damping, {}, points);
      }
    }
}

TEST(Step, IsTheTextbooksWithSharedLenses) {
  for (std::uint32_t together : {2u, 12u})
    for (bool keep_unused : {false, true}) {
      const Problem problem = first_points(shared_lens_scene(together, keep_unused).start, 40);
      for (const Fixed& fixed : {Fixed(), points_held()})
        for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
    }
}

TEST(Step, IsTheTextbooksWhereOneImageSeesAPointTwice) {
  Problem problem = first_points(small_scene().start, 40);
  for (std::size_t i = 0; i < 60; i += 3)
    for (std::size_t times = 0; times <= i % 2; ++times)
      problem.add_observation(problem.observation_image[i], problem.observation_point[i],
                              problem.observation_xy[2 * i] + 3, problem.observation_xy[2 * i + 1]);
  for (const Fixed& fixed : {Fixed(), points_held()})
    for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
}

}  // namespace
}  // namespace sheaf
