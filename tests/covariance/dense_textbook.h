// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/loss.h"
#include "geometry/rigid_motion.h"
#include "scene/rigs.h"
#include "scene/terms.h"
#include "sheaf/covariance.h"

// The covariance by the book: every unknown a column of one dense Jacobian by differences of the
// whole problem, inverted as it stands, the gauge as Lagrange's multipliers.
namespace sheaf::test {

/// A way to move one unknown of a problem.
struct Unknown {
  enum class Kind { image, frame, sensor, lens, point } kind;
  std::uint32_t index;
  std::uint8_t part;
  double size;  ///< of a step that changes residuals by a few pixels
};

inline void move(Problem& p, const Unknown& u, double by) {
  const auto turn = [&](Pose& pose) {
    Vector3<double> rho{}, phi{};
    (u.part < 3 ? rho[u.part] : phi[u.part - 3u]) = by;
    const auto moved = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
    pose.rotation = moved.rotation, pose.translation = moved.translation;
  };
  switch (u.kind) {
    case Unknown::Kind::image:
      return turn(p.poses[u.index]);
    case Unknown::Kind::frame:
      return turn(p.rigs.rig_from_world[u.index]);
    case Unknown::Kind::sensor:
      return turn(p.rigs.sensor_from_rig[u.index]);
    case Unknown::Kind::lens:
      p.cameras[u.index].parameters[u.part] += by;
      return;
    case Unknown::Kind::point:
      p.points[3 * u.index + u.part] += by;
  }
}

inline Vector3<double> seen_from(const Pose& pose, const double* X) {
  Vector3<double> P =
      multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{X[0], X[1], X[2]});
  for (std::size_t k = 0; k < 3; ++k) P[k] += pose.translation[k];
  return P;
}

/// All residuals, weighed as at the state `at`.
inline Eigen::VectorXd residuals(const Problem& p, const std::vector<double>& roots) {
  std::vector<double> out;
  std::size_t block = 0;
  const auto add = [&](const std::vector<double>& r) {
    const double root = roots.empty() ? 1 : roots[block];
    ++block;
    for (const double x : r) out.push_back(root * x);
  };
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    const std::uint32_t image = p.observation_image[i];
    const Camera& camera = p.cameras[p.image_camera[image]];
    const Projected at =
        project(camera, seen_from(pose_of(p, image), &p.points[3 * p.observation_point[i]]));
    const auto e = residual(camera, at.pixel, &p.observation_xy[2 * i]);
    const double sigma = p.observation_sigma.empty() ? 1 : p.observation_sigma[i];
    add({e[0] / sigma, e[1] / sigma});
  }
  const auto whitened = [](const Covariance3& C, const Vector3<double>& e) {
    const Eigen::Matrix3d U =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(C.data())
            .inverse()
            .llt()
            .matrixU();
    const Eigen::Vector3d r = U * Eigen::Vector3d(e[0], e[1], e[2]);
    return std::vector<double>{r[0], r[1], r[2]};
  };
  for (const CentrePrior& of : p.terms.centres) {
    const Pose pose = pose_of(p, of.image);
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    Vector3<double> e{};
    for (std::size_t k = 0; k < 3; ++k) {
      e[k] = -of.position[k];
      for (std::size_t i = 0; i < 3; ++i)
        e[k] += R[3 * i + k] * (of.lever_arm[i] - pose.translation[i]);
    }
    add(whitened(of.covariance, e));
  }
  for (const ParameterPrior& of : p.terms.parameters)
    add({(p.cameras[of.camera].parameters[of.parameter] - of.value) / of.sigma});
  for (const PointPrior& of : p.terms.points)
    add(whitened(of.covariance, {p.points[3 * of.point] - of.position[0],
                                 p.points[3 * of.point + 1] - of.position[1],
                                 p.points[3 * of.point + 2] - of.position[2]}));
  for (const DistancePrior& of : p.terms.distances) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k)
      sum += std::pow(p.points[3 * of.first + k] - p.points[3 * of.second + k], 2);
    add({(std::sqrt(sum) - of.distance) / of.sigma});
  }
  return Eigen::Map<Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

/// sqrt(rho') of each observation at the state; terms have none.
inline std::vector<double> roots_of(const Problem& p, const Loss& loss) {
  const Eigen::VectorXd r = residuals(p, {});
  std::vector<double> out(p.num_observations() + p.terms.centres.size() +
                              p.terms.parameters.size() + p.terms.points.size() +
                              p.terms.distances.size(),
                          1);
  if (loss.kind == LossKind::none) return out;
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(p.num_observations()); ++i)
    out[static_cast<std::size_t>(i)] = std::sqrt(
        evaluate_loss(ScaledLoss{loss.kind, loss.scale_px}, r.segment(2 * i, 2).squaredNorm())
            .first);
  return out;
}

struct Book {
  std::vector<Unknown> unknowns;
  Eigen::MatrixXd C;
  Eigen::Index deficit = 0;
  double condition = 1;  ///< of J^T W J with columns of length 1, beside the gauge

  Eigen::Index first(Unknown::Kind kind, std::uint32_t index) const {
    for (std::size_t k = 0; k < unknowns.size(); ++k)
      if (unknowns[k].kind == kind && unknowns[k].index == index)
        return static_cast<Eigen::Index>(k);
    return -1;
  }
};

/// The inverse of J^T W J under G^T D delta = 0, D = 1 on the unknowns for which `held` is true.
inline Book by_the_book(const Problem& p, const Fixed& fixed, const Loss& loss,
                        const std::function<bool(const Unknown&)>& held) {
  Book out;
  const auto add = [&](Unknown::Kind kind, std::uint32_t index, std::uint8_t count, double size) {
    for (std::uint8_t k = 0; k < count; ++k) out.unknowns.push_back({kind, index, k, size});
  };
  const auto trivial = trivial_frames(p.rigs);
  for (std::uint32_t i = 0; i < p.num_images(); ++i)
    if (!fixed.poses && (!in_rig(p.rigs, i) || trivial[p.rigs.image_frame[i]] != 0))
      add(Unknown::Kind::image, i, 6, 1e-4);
  for (std::uint32_t f = 0; f < p.rigs.num_frames(); ++f)
    if (!fixed.poses && trivial[f] == 0) add(Unknown::Kind::frame, f, 6, 1e-4);
  for (std::uint32_t s = 0; s < p.rigs.num_sensors(); ++s)
    if (!fixed.sensors && p.rigs.is_reference[s] == 0) add(Unknown::Kind::sensor, s, 6, 1e-4);
  const auto held_of = held_parameters(p, fixed);
  for (std::uint32_t c = 0; c < p.cameras.size(); ++c)
    for (std::uint8_t k = 0; k < parameter_count(p.cameras[c].model); ++k)
      if ((held_of[c] >> k & 1) == 0)
        out.unknowns.push_back(
            {Unknown::Kind::lens, c, k, 1e-4 * std::max(1.0, p.cameras[c].parameters[k])});
  if (!fixed.points)
    for (std::uint32_t j = 0; j < p.num_points(); ++j) add(Unknown::Kind::point, j, 3, 1e-4);
  const std::vector<double> roots = roots_of(p, loss);
  const Eigen::Index rows = residuals(p, roots).size(),
                     n = static_cast<Eigen::Index>(out.unknowns.size());
  Eigen::MatrixXd J(rows, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    Unknown u = out.unknowns[static_cast<std::size_t>(k)];
    const auto at = [&](double steps) {
      Problem moved = p;
      move(moved, u, steps * u.size);
      return residuals(moved, roots);
    };
    u.size *= 0.6 / (at(1) - at(-1)).cwiseAbs().maxCoeff();  // steps of a third of a pixel
    J.col(k) = (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * u.size);
  }
  // Long doubles, so that what differs is not this.
  using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  using WideVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  const Wide exact = J.cast<long double>().transpose() * J.cast<long double>();
  const WideVector scale = exact.diagonal().cwiseSqrt().cwiseInverse();
  const Wide scaled = scale.asDiagonal() * exact * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Wide> eigen(scaled);
  while (out.deficit < n && eigen.eigenvalues()[out.deficit] < 1e-14L) ++out.deficit;
  const Eigen::Index d = out.deficit;
  out.condition = static_cast<double>(eigen.eigenvalues()[n - 1] / eigen.eigenvalues()[d]);
  Wide K = Wide::Zero(n + d, n + d);
  K.topLeftCorner(n, n) = scaled;
  const Wide G = scale.asDiagonal() * eigen.eigenvectors().leftCols(d);
  for (Eigen::Index k = 0; k < n; ++k)
    if (held(out.unknowns[static_cast<std::size_t>(k)])) {
      K.block(k, n, 1, d) = scale[k] * G.row(k);
      K.block(n, k, d, 1) = K.block(k, n, 1, d).transpose();
    }
  // Constraints in the size of the rest.
  for (Eigen::Index c = n; c < n + d; ++c) {
    const long double by = 1 / K.col(c).norm();
    K.col(c) *= by;
    K.row(c) = K.col(c).transpose();
  }
  const Wide inverse = K.partialPivLu().inverse();
  out.C = (scale.asDiagonal() * inverse.topLeftCorner(n, n) * scale.asDiagonal()).cast<double>();
  return out;
}

}  // namespace sheaf::test
