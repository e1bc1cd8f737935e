// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/wide_textbook.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/dual.h"
#include "geometry/motion_log.h"
#include "lists/block_map.h"
#include "scene/rigs.h"
#include "scene/terms.h"
#include "sheaf/solve.h"
#include "systems/block_fold.h"

namespace sheaf {
namespace {

using D = test::Dual<double, 40>;
using Kind = GaussianPrior::Block::Kind;

/// Variables of a term: the columns of the textbook that they are, and how many so far.
struct Variables {
  const Problem& p;
  const Places& at;
  std::vector<int> columns;

  D variable(double value, int column) {
    columns.push_back(column);
    return D::variable(value, static_cast<int>(columns.size()) - 1);
  }
  RigidMotion<D> pose(std::uint32_t i) {
    Vector3<D> rho, phi;
    for (int k = 0; k < 3; ++k) rho[k] = variable(0, at.pose[6 * i + k]);
    for (int k = 0; k < 3; ++k) phi[k] = variable(0, at.pose[6 * i + 3 + k]);
    RigidMotion<D> T;
    const Pose of = pose_of(p, i);
    for (int k = 0; k < 4; ++k) T.rotation[k] = of.rotation[k];
    for (int k = 0; k < 3; ++k) T.translation[k] = of.translation[k];
    return left_perturbed(T, rho, phi);
  }
  Vector3<D> point(std::uint32_t j) {
    Vector3<D> X;
    for (int k = 0; k < 3; ++k) X[k] = variable(p.points[3 * j + k], at.point[3 * j + k]);
    return X;
  }
};

struct TermRow {
  std::vector<D> r;
  std::vector<int> columns;
  TermLoss loss;
};

std::vector<D> whitened(const Covariance3& covariance, const Vector3<D>& e) {
  const auto U = *whitening(covariance);
  std::vector<D> r(3);
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) r[i] = r[i] + D(U[3 * i + k]) * e[k];
  return r;
}

TermRow row_of(const CentrePrior& prior, Variables v) {
  const RigidMotion<D> T = v.pose(prior.image);
  const Matrix3<D> R = matrix_from_quaternion(T.rotation);
  Vector3<D> e;
  for (int k = 0; k < 3; ++k) {
    e[k] = D(-prior.position[k]);
    for (int i = 0; i < 3; ++i)
      e[k] = e[k] + R[3 * i + k] * (D(prior.lever_arm[i]) - T.translation[i]);
  }
  return {whitened(prior.covariance, e), v.columns, prior.loss};
}

TermRow row_of(const RotationPrior& prior, Variables v) {
  const auto& q = prior.rotation;
  const Quaternion<D> back{D(q[0]), D(-q[1]), D(-q[2]), D(-q[3])};
  const Vector3<D> phi = angle_axis_from_quaternion(multiply(v.pose(prior.image).rotation, back));
  return {whitened(prior.covariance, phi), v.columns, prior.loss};
}

TermRow row_of(const GravityPrior& prior, Variables v) {
  const Vector3<D> down{prior.down[0], prior.down[1], prior.down[2]};
  const Vector3<D> measured{prior.measured[0], prior.measured[1], prior.measured[2]};
  const Matrix3<D> R = matrix_from_quaternion(v.pose(prior.image).rotation);
  std::vector<D> r;
  for (const D& e : cross(multiply(R, down), measured)) r.push_back(e / D(prior.sigma_rad));
  return {r, v.columns, prior.loss};
}

TermRow row_of(const RelativePosePrior& prior, Variables v) {
  RigidMotion<D> measured;
  for (int k = 0; k < 4; ++k) measured.rotation[k] = prior.rotation[k];
  for (int k = 0; k < 3; ++k) measured.translation[k] = prior.translation[k];
  const RigidMotion<D> a = v.pose(prior.first), b = v.pose(prior.second);
  const auto d = log_of(composed(composed(b, inverse(a)), inverse(measured)));
  std::vector<D> r(6);
  for (int i = 0; i < 6; ++i)
    for (int k = 0; k < 6; ++k) r[i] = r[i] + D(prior.square_root[6 * i + k]) * d[k];
  return {r, v.columns, prior.loss};
}

TermRow row_of(const ParameterPrior& prior, Variables v) {
  const D x = v.variable(v.p.cameras[prior.camera].parameters[prior.parameter],
                         v.at.lens[kMaxCameraParameters * prior.camera + prior.parameter]);
  return {{(x - D(prior.value)) / D(prior.sigma)}, v.columns, prior.loss};
}

TermRow row_of(const PointPrior& prior, Variables v) {
  Vector3<D> e = v.point(prior.point);
  for (int k = 0; k < 3; ++k) e[k] = e[k] - D(prior.position[k]);
  return {whitened(prior.covariance, e), v.columns, {}};
}

TermRow row_of(const DistancePrior& prior, Variables v) {
  const Vector3<D> a = v.point(prior.first), b = v.point(prior.second);
  D square(0);
  for (int k = 0; k < 3; ++k) square = square + (a[k] - b[k]) * (a[k] - b[k]);
  return {{(sqrt(square) - D(prior.distance)) / D(prior.sigma)}, v.columns, prior.loss};
}

TermRow row_of(const GaussianPrior& prior, Variables v) {
  std::vector<D> d;
  for (const auto& block : prior.blocks) {
    const std::vector<double>& s = block.state;
    if (block.kind == Kind::pose) {
      const RigidMotion<D> state{{s[0], s[1], s[2], s[3]}, {s[4], s[5], s[6]}};
      for (const D& x : log_of(composed(v.pose(block.index), inverse(state)))) d.push_back(x);
    } else if (block.kind == Kind::camera) {
      for (std::size_t k = 0; k < s.size(); ++k)
        d.push_back(v.variable(v.p.cameras[block.index].parameters[k] - s[k],
                               v.at.lens[kMaxCameraParameters * block.index + k]));
    } else {
      const Vector3<D> X = v.point(block.index);
      for (int k = 0; k < 3; ++k) d.push_back(X[k] - D(s[k]));
    }
  }
  std::vector<D> r(prior.square_root.size() / d.size());
  for (std::size_t i = 0; i < r.size(); ++i)
    for (std::size_t k = 0; k < d.size(); ++k)
      r[i] = r[i] + D(prior.square_root[i * d.size() + k]) *
                        (prior.mean.empty() ? d[k] : d[k] - D(prior.mean[k]));
  return {r, v.columns, prior.loss};
}

std::vector<TermRow> term_rows(const Problem& p, const Places& at) {
  std::vector<TermRow> out;
  const Variables none{p, at, {}};
  for (const auto& of : p.terms.centres) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.rotations) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.gravities) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.relative_poses) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.parameters) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.points) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.distances) out.push_back(row_of(of, none));
  for (const auto& of : p.terms.gaussians) out.push_back(row_of(of, none));
  return out;
}

LossValue<double> rho_of(const TermRow& row) {
  double s = 0;
  for (const D& r : row.r) s += r.value * r.value;
  return evaluate_loss({row.loss.kind, row.loss.scale}, s);
}

void add_terms(const Problem& p, const Places& at, Normal& normal) {
  for (const TermRow& row : term_rows(p, at)) {
    const LossValue<double> rho = rho_of(row);
    const double w = std::sqrt(rho.first);
    normal.cost += rho.value / 2;
    for (const D& r : row.r) {
      std::vector<std::pair<int, double>> entries;
      for (std::size_t k = 0; k < row.columns.size(); ++k)
        entries.emplace_back(row.columns[k], w * r.d[k]);
      normal.add_row(entries, w * r.value);
    }
  }
}

double robust_cost_of(const Problem& p, const ScaledLoss& loss) {
  const Places at(p, {});
  return Normal(p, at, loss, Charts(p)).cost + cost_of_terms(p) / 2;
}

/// Columns of the textbook's images, frames and sensors: x_images = M x.
struct RigPlaces {
  std::vector<std::vector<std::pair<int, double>>> rows;  ///< of each column of the images' places
  int count = 0;
  std::vector<int> frames, sensors, images;

  RigPlaces(const Problem& p, const Fixed& fixed, const Places& of_images) : rows(of_images.count) {
    const MovingPoses moving = moving_poses(p, fixed);
    const auto number = [&](const std::vector<std::uint8_t>& moves) {
      std::vector<int> first;
      for (const std::uint8_t m : moves) {
        first.push_back(m != 0 ? count : -1);
        count += m != 0 ? 6 : 0;
      }
      return first;
    };
    frames = number(moving.frames), sensors = number(moving.sensors);
    images = number(moving.images);
    const Adjoints adjoints = adjoints_of(camera_state(p));
    for (std::size_t i = 0; i < p.num_images(); ++i)
      for (int k = 0; k < 6; ++k) {
        auto& row = rows[of_images.pose[6 * i + k]];
        if (!in_rig(p.rigs, i)) {
          if (images[i] >= 0) row.emplace_back(images[i] + k, 1.0);
          continue;
        }
        const std::uint32_t f = p.rigs.image_frame[i], s = p.rigs.image_sensor[i];
        for (int c = 0; c < 6 && frames[f] >= 0; ++c)
          row.emplace_back(frames[f] + c, adjoints[s](k, c));
        if (sensors[s] >= 0) row.emplace_back(sensors[s] + k, 1.0);
      }
    for (const auto* places : {&of_images.lens, &of_images.point})
      for (const int column : *places)
        if (column >= 0) rows[column].emplace_back(count++, 1.0);
  }
};

/// M^T A M with D added, and M^T b.
struct WideNormal {
  std::vector<double> A, b;

  WideNormal(const RigPlaces& M, const Normal& of, double lambda)
      : A(static_cast<std::size_t>(M.count) * M.count), b(M.count) {
    const std::size_t n = b.size(), wide = M.rows.size();
    std::vector<double> squares(n);
    for (std::size_t r = 0; r < wide; ++r)
      for (const auto& [i, mi] : M.rows[r]) {
        b[i] += mi * of.b[r];
        squares[i] += mi * mi * of.A[r * wide + r];
        for (std::size_t c = 0; c < wide; ++c)
          for (const auto& [k, mk] : M.rows[c]) A[i * n + k] += mi * mk * of.A[r * wide + c];
      }
    for (std::size_t i = 0; i < n; ++i) A[i * n + i] += lambda * std::clamp(squares[i], 1e-6, 1e32);
  }
};

Problem stepped(const Problem& start, const Places& places, const RigPlaces& M,
                const std::vector<double>& x) {
  Problem out = start;
  std::vector<double> by_image(M.rows.size());
  for (std::size_t r = 0; r < M.rows.size(); ++r)
    for (const auto& [i, mi] : M.rows[r]) by_image[r] += mi * x[i];
  move(out, places, by_image, Charts(start));
  const auto step = [&](Pose& pose, int at) {
    if (at < 0) return;
    const auto to =
        left_perturbed<double>({pose.rotation, pose.translation}, {x[at], x[at + 1], x[at + 2]},
                               {x[at + 3], x[at + 4], x[at + 5]});
    pose = {to.rotation, to.translation};
  };
  for (std::size_t f = 0; f < M.frames.size(); ++f) step(out.rigs.rig_from_world[f], M.frames[f]);
  for (std::size_t s = 0; s < M.sensors.size(); ++s)
    step(out.rigs.sensor_from_rig[s], M.sensors[s]);
  place_images(out);
  return out;
}

}  // namespace

double cost_of_terms(const Problem& problem) {
  const Places at(problem, {});
  double sum = 0;
  for (const TermRow& row : term_rows(problem, at)) sum += rho_of(row).value;
  return sum;
}

void expect_rigid(const Problem& p) {
  for (std::size_t i = 0; i < p.num_images(); ++i) {
    const Pose pose = pose_of(p, i);
    EXPECT_EQ(pose.rotation, p.poses[i].rotation) << i;
    EXPECT_EQ(pose.translation, p.poses[i].translation) << i;
  }
}

void expect_wide_step(const Problem& start, const Fixed& fixed, CameraSolverKind solver,
                      const Loss& loss) {
  const double lambda = 1e-4;
  Fixed beside_poses = fixed;
  beside_poses.poses = false;
  beside_poses.pose_ids.clear();
  const Places places(start, beside_poses);
  const ScaledLoss scaled{loss.kind, loss.scale_px};
  Normal normal(start, places, scaled, Charts(start));
  add_terms(start, places, normal);
  const RigPlaces M(start, fixed, places);
  const WideNormal wide(M, normal, lambda);
  const std::vector<double> x = solve_dense(wide.A, wide.b);
  const double expected = robust_cost_of(stepped(start, places, M, x), scaled);

  Problem p = start;
  SolveOptions options;
  options.max_iterations = 1;
  options.initial_damping = lambda;
  options.inner_iterations = 0;
  options.fixed = fixed;
  options.loss = loss;
  options.points = PointParametrisation::xyz;
  options.solver = solver;
  const Summary summary = solve(p, options);
  ASSERT_EQ(summary.iterations.size(), 2u);
  EXPECT_NEAR(summary.iterations[1].trial_cost, expected, 1e-8 * expected) << summary.solver;
  EXPECT_NEAR(summary.initial_cost, normal.cost, 1e-9 * summary.initial_cost);
  expect_rigid(p);
}

}  // namespace sheaf
