// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/scene_gauge.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "scene/rigs.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// A free motion's rows cancel to rounding, whose square this is far above; any prior that anybody
/// would state is far above it in turn.
constexpr double kFree = 1e-18;
constexpr double kHardly = 1e-12;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using View = Eigen::Map<const Rows>;

Eigen::Index index(std::size_t n) { return static_cast<Eigen::Index>(n); }

/// The inverse of a small positive definite matrix; nothing where it is singular to rounding.
std::optional<Eigen::MatrixXd> inverse_of(const Eigen::MatrixXd& M) {
  if (M.rows() == 0) return M;
  const Eigen::VectorXd d = M.diagonal().cwiseSqrt();
  if (!(d.minCoeff() > 0)) return {};
  const Eigen::MatrixXd scaled = d.cwiseInverse().asDiagonal() * M * d.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  if (!(eigen.eigenvalues().minCoeff() > kHardly)) return {};
  const Eigen::MatrixXd inverse = scaled.inverse();
  return Eigen::MatrixXd(d.cwiseInverse().asDiagonal() * inverse * d.cwiseInverse().asDiagonal());
}

/// Columns of blocks of poses that are not sensors: shifts, or all six.
std::vector<std::int32_t> pose_columns(const ParameterBlocks& blocks, int each) {
  std::vector<std::int32_t> out;
  for (const auto* list : {&blocks.image, &blocks.frame})
    for (const std::uint32_t block : *list)
      for (int k = 0; block != ParameterBlocks::kNone && k < each; ++k)
        out.push_back(blocks.first[block] + k);
  return out;
}

}  // namespace

SceneGauge::SceneGauge(const Problem& problem, const NormalEquations& equations) {
  place(problem);
  const std::vector<double> all = all_of_columns(problem, equations.blocks());
  const auto of_point = [&](std::size_t p, double* of) {
    const Directions here = all_of_point(&problem.points[3 * p]);
    std::copy(here.begin(), here.end(), of);
  };
  find_free(all, equations.gram(all, kAll, of_point), equations.squares());
  const std::size_t columns = all.size() / kAll;
  columns_.assign(count() * columns, 0);
  for (std::size_t c = 0; c < columns; ++c)
    for (std::size_t d = 0; d < count(); ++d)
      for (std::size_t g = 0; g < kAll; ++g)
        columns_[count() * c + d] += all[kAll * c + g] * free_[count() * g + d];
}

/// About the mean camera centre, in the cameras' mean distance from it.
void SceneGauge::place(const Problem& problem) {
  const auto images = static_cast<double>(problem.num_images());
  std::vector<Vector3<double>> centres;
  for (const Pose& pose : problem.poses)
    centres.push_back(camera_centre(matrix_from_quaternion(pose.rotation), pose));
  for (const auto& C : centres)
    for (std::size_t k = 0; k < 3; ++k) origin_[k] += C[k] / images;
  double length = 0;
  for (const auto& C : centres)
    length += std::hypot(C[0] - origin_[0], C[1] - origin_[1], C[2] - origin_[2]) / images;
  if (length > 0) unit_ = length;
}

/// columns x 7.
std::vector<double> SceneGauge::all_of_columns(const Problem& problem,
                                               const ParameterBlocks& blocks) const {
  std::vector<double> all(kAll * static_cast<std::size_t>(blocks.columns()), 0);
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    if (blocks.rigid[i] == 0) add_pose(blocks.image[i], problem.poses[i], blocks, all);
  for (std::size_t f = 0; f < blocks.frame.size(); ++f)
    add_pose(blocks.frame[f], problem.rigs.rig_from_world[f], blocks, all);
  for (std::size_t s = 0; s < blocks.sensor.size(); ++s)
    for (std::size_t k = 0; blocks.sensor[s] != ParameterBlocks::kNone && k < 3; ++k)
      all[kAll * (static_cast<std::size_t>(blocks.first[blocks.sensor[s]]) + k) + 6] =
          problem.rigs.sensor_from_rig[s].translation[k];
  for (std::size_t k = 0; k < blocks.kept.size(); ++k) {
    if (blocks.kept_block[k] == ParameterBlocks::kNone) continue;
    const Directions of = all_of_point(&problem.points[3 * std::size_t(blocks.kept[k])]);
    std::copy(of.begin(), of.end(),
              &all[kAll * static_cast<std::size_t>(blocks.first[blocks.kept_block[k]])]);
  }
  return all;
}

/// The combinations that no row notices: eigenvectors of what rows notice of the seven, each in the
/// size that its columns would have if they did not work together.
void SceneGauge::find_free(const std::vector<double>& all, const std::vector<double>& sums,
                           const std::vector<double>& squares) {
  Eigen::VectorXd scale = Eigen::VectorXd::Zero(kAll);
  for (std::size_t c = 0; c < squares.size(); ++c)
    for (std::size_t g = 0; g < kAll; ++g)
      scale[index(g)] += all[kAll * c + g] * all[kAll * c + g] * squares[c];
  scale = scale.cwiseSqrt().eval();
  std::vector<Eigen::Index> moves;
  for (Eigen::Index g = 0; g < scale.size(); ++g)
    if (scale[g] > 0) moves.push_back(g);
  if (moves.empty()) return;
  const View K(sums.data(), kAll, kAll);
  Eigen::MatrixXd scaled(index(moves.size()), index(moves.size()));
  for (std::size_t a = 0; a < moves.size(); ++a)
    for (std::size_t b = 0; b < moves.size(); ++b)
      scaled(index(a), index(b)) = K(moves[a], moves[b]) / (scale[moves[a]] * scale[moves[b]]);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  std::vector<Eigen::VectorXd> found;
  for (Eigen::Index e = 0; e < scaled.rows() && eigen.eigenvalues()[e] < kFree; ++e) {
    Eigen::VectorXd v = Eigen::VectorXd::Zero(kAll);
    for (std::size_t a = 0; a < moves.size(); ++a)
      v[moves[a]] = eigen.eigenvectors()(index(a), e) / scale[moves[a]];
    found.push_back(v / v.cwiseAbs().maxCoeff());
  }
  free_.resize(kAll * found.size());
  for (std::size_t g = 0; g < kAll; ++g)
    for (std::size_t d = 0; d < found.size(); ++d) free_[found.size() * g + d] = found[d][index(g)];
}

/// A shift a, a turn w and a change of size s move X by a + w x (X - o) + s (X - o), shifts in
/// units of the scene.
SceneGauge::Directions SceneGauge::all_of_point(const double* X) const {
  const Vector3<double> d{X[0] - origin_[0], X[1] - origin_[1], X[2] - origin_[2]};
  Directions out{};
  for (std::size_t k = 0; k < 3; ++k) {
    out[kAll * k + k] = unit_;
    Vector3<double> w{};
    w[k] = 1;
    const Vector3<double> turned = cross(w, d);
    for (std::size_t i = 0; i < 3; ++i) out[kAll * i + 3 + k] = turned[i];
    out[kAll * k + 6] = d[k];
  }
  return out;
}

/// cam_from_world of the moved world: phi = -R w, rho = s t - R a' + (R w) x t with a' the shift of
/// the world's origin, a - w x o - s o.
void SceneGauge::add_pose(std::uint32_t block, const Pose& pose, const ParameterBlocks& blocks,
                          std::vector<double>& all) const {
  if (block == ParameterBlocks::kNone) return;
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  double* to = &all[kAll * static_cast<std::size_t>(blocks.first[block])];
  const Vector3<double> t{pose.translation[0], pose.translation[1], pose.translation[2]};
  const Vector3<double> origin{origin_[0], origin_[1], origin_[2]};
  const Vector3<double> turned_origin = multiply(R, origin);
  for (std::size_t k = 0; k < 3; ++k) {
    Vector3<double> w{};
    w[k] = 1;
    const Vector3<double> Rw{R[k], R[3 + k], R[6 + k]};
    const Vector3<double> about = multiply(R, cross(w, origin)), turn = cross(Rw, t);
    for (std::size_t i = 0; i < 3; ++i) {
      to[kAll * i + k] = -unit_ * R[3 * i + k];
      to[kAll * i + 3 + k] = about[i] + turn[i];
      to[kAll * (3 + i) + 3 + k] = -Rw[i];
    }
    to[kAll * k + 6] = t[k] + turned_origin[k];
  }
}

void SceneGauge::of_point(const double* X, double* out) const {
  const Directions all = all_of_point(X);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t d = 0; d < count(); ++d) {
      out[count() * k + d] = 0;
      for (std::size_t g = 0; g < kAll; ++g)
        out[count() * k + d] += all[kAll * k + g] * free_[count() * g + d];
    }
}

std::vector<std::string> SceneGauge::names() const {
  static const char* const kNames[] = {"a shift along x", "a shift along y", "a shift along z",
                                       "a turn about x",  "a turn about y",  "a turn about z",
                                       "the scale"};
  std::vector<std::string> out;
  if (count() == 0) return out;
  const Eigen::MatrixXd F = View(free_.data(), kAll, index(count()));
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(F);
  const Eigen::MatrixXd Q = qr.householderQ() * Eigen::MatrixXd::Identity(kAll, index(count()));
  for (Eigen::Index g = 0; g < 7; ++g)
    if (Q.row(g).squaredNorm() > 1 - 1e-6) out.push_back(kNames[g]);
  return out;
}

std::vector<std::int32_t> SceneGauge::minimal_constraints(
    const std::vector<double>& squares) const {
  const std::size_t n = squares.size(), d = count();
  Rows left(index(n), index(d));
  for (std::size_t c = 0; c < n; ++c)
    for (std::size_t k = 0; k < d; ++k)
      left(index(c), index(k)) = std::sqrt(squares[c]) * columns_[d * c + k];
  std::vector<std::int32_t> out;
  for (std::size_t k = 0; k < d; ++k) {
    Eigen::Index row = 0, column = 0;
    if (!(left.cwiseAbs().maxCoeff(&row, &column) > 0)) break;
    out.push_back(static_cast<std::int32_t>(row));
    const Eigen::RowVectorXd pivot = left.row(row);
    // Columns of G are combined so that only one of them moves the pinned column, and goes.
    for (Eigen::Index other = 0; other < left.cols(); ++other) {
      if (other == column) continue;
      const double by = pivot[other] / pivot[column];
      left.col(other) -= by * left.col(column);
    }
    left.col(column).setZero();
    left.row(row).setZero();
  }
  std::sort(out.begin(), out.end());
  return out;
}

namespace {

/// (G^T W G)^-1 G^T W with W = 1 on some columns.
std::optional<std::vector<double>> least_trace(const SceneGauge& gauge, std::int32_t columns,
                                               const std::vector<std::int32_t>& chosen) {
  const Eigen::Index d = index(gauge.count());
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(d, d);
  for (const std::int32_t c : chosen) {
    const Eigen::Map<const Eigen::RowVectorXd> g(gauge.of_column(c), d);
    sum += g.transpose() * g;
  }
  const auto inverse = inverse_of(sum);
  if (!inverse) return {};
  std::vector<double> out(gauge.count() * static_cast<std::size_t>(columns), 0);
  for (const std::int32_t c : chosen) {
    const Eigen::Map<const Eigen::VectorXd> g(gauge.of_column(c), d);
    const Eigen::VectorXd a = *inverse * g;
    for (Eigen::Index k = 0; k < d; ++k)
      out[static_cast<std::size_t>(k) * static_cast<std::size_t>(columns) +
          static_cast<std::size_t>(c)] = a[k];
  }
  return out;
}

/// The first image's six columns and the largest part of the second one's baseline, held exactly.
std::optional<std::vector<double>> first_two(const Problem& problem, const ParameterBlocks& blocks,
                                             const SceneGauge& gauge) {
  std::vector<std::uint32_t> poses;
  std::vector<const Pose*> at;
  for (std::size_t i = 0; i < blocks.image.size(); ++i)
    if (blocks.image[i] != ParameterBlocks::kNone)
      poses.push_back(blocks.image[i]), at.push_back(&problem.poses[i]);
  for (std::size_t f = 0; f < blocks.frame.size(); ++f)
    if (blocks.frame[f] != ParameterBlocks::kNone)
      poses.push_back(blocks.frame[f]), at.push_back(&problem.rigs.rig_from_world[f]);
  if (poses.size() < 2) return {};
  // B delta = 0: six columns, and (rho + phi x t)_k of the second pose, its translation.
  const Vector3<double> C = camera_centre(matrix_from_quaternion(at[0]->rotation), *at[0]);
  const Vector3<double> baseline =
      in_camera(matrix_from_quaternion(at[1]->rotation), *at[1], C.data());
  const auto k = static_cast<std::size_t>(
      std::max_element(baseline.begin(), baseline.end(),
                       [](double x, double y) { return std::abs(x) < std::abs(y); }) -
      baseline.begin());
  const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
  const Eigen::Index d = index(gauge.count()), n = blocks.columns();
  if (d != 7) return {};
  Rows B = Rows::Zero(d, n);
  for (Eigen::Index row = 0; row < 6; ++row) B(row, blocks.first[poses[0]] + row) = 1;
  const std::int32_t second = blocks.first[poses[1]];
  B(6, second + index(k)) = 1;
  B(6, second + 3 + index(u)) = at[1]->translation[v];
  B(6, second + 3 + index(v)) = -at[1]->translation[u];
  const Eigen::MatrixXd held = B * View(gauge.of_columns().data(), n, d);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(held);
  if (!lu.isInvertible()) return {};
  const Rows A = lu.inverse() * B;
  return std::vector<double>(A.data(), A.data() + A.size());
}

}  // namespace

Result<GaugeWeights> gauge_weights(const Problem& problem, const ParameterBlocks& blocks,
                                   const SceneGauge& gauge, Gauge kind) {
  GaugeWeights out;
  if (gauge.count() == 0) return out;
  if (kind == Gauge::data)
    return Error(ErrorCode::usage,
                 "the data leave " + std::to_string(gauge.count()) +
                     " of the scene's seven freedoms: state another gauge than data");
  if (kind == Gauge::first_two) {
    const auto held = first_two(problem, blocks, gauge);
    if (!held)
      return Error(ErrorCode::usage,
                   "the gauge first-two needs two free images and a scene of seven freedoms, this "
                   "one has " +
                       std::to_string(gauge.count()));
    out.of_columns = *held;
    out.words = "the first pose and one coordinate of the second one's translation are exact";
    return out;
  }
  if (kind == Gauge::free_points) {
    const Eigen::Index d = index(gauge.count());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(d, d);
    std::vector<double> g(3 * gauge.count());
    for (std::size_t p = 0; p < problem.num_points(); ++p) {
      gauge.of_point(&problem.points[3 * p], g.data());
      const Rows here = View(g.data(), 3, d);
      sum += here.transpose() * here;
    }
    const auto inverse = inverse_of(sum);
    if (!inverse)
      return Error(ErrorCode::usage, "the points do not span the scene: state another gauge");
    out.of_columns.assign(gauge.count() * static_cast<std::size_t>(blocks.columns()), 0);
    for (const std::uint32_t block : blocks.kept_block)
      for (std::int32_t c = 0; block != ParameterBlocks::kNone && c < 3; ++c) {
        const std::int32_t column = blocks.first[block] + c;
        const Eigen::VectorXd a =
            *inverse * Eigen::Map<const Eigen::VectorXd>(gauge.of_column(column), d);
        for (Eigen::Index k = 0; k < d; ++k)
          out.of_columns[static_cast<std::size_t>(k * blocks.columns() + column)] = a[k];
      }
    for (Eigen::Index r = 0; r < d; ++r)
      for (Eigen::Index k = 0; k < d; ++k) out.of_points.push_back((*inverse)(r, k));
    out.words = "inner constraints: the trace over points is least";
    return out;
  }
  if (const auto centres = least_trace(gauge, blocks.columns(), pose_columns(blocks, 3))) {
    out.of_columns = *centres;
    out.words = "inner constraints: the trace over camera centres is least";
    return out;
  }
  const auto poses = least_trace(gauge, blocks.columns(), pose_columns(blocks, 6));
  if (!poses)
    return Error(ErrorCode::usage, "no free poses hold the scene: state the gauge free-points");
  out.of_columns = *poses;
  out.words =
      "inner constraints: the trace over camera poses is least (the centres stand in a line, which "
      "leaves a turn)";
  return out;
}

}  // namespace sheaf
