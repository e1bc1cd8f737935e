// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/similarity.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "scene/rigs.h"

namespace sheaf {
namespace {

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

bool turns(const Similarity& S) {
  return S.rotation[1] != 0 || S.rotation[2] != 0 || S.rotation[3] != 0;
}

bool is_identity(const Similarity& S) {
  return S.scale == 1 && !turns(S) && S.translation == Vector3<double>{0, 0, 0};
}

/// Of the rotation of a pose: cam_from_world, whose world turns.
Quaternion<double> turned(const Quaternion<double>& q, const Similarity& S) {
  return turns(S) ? normalized(multiply(q, conjugate(S.rotation))) : q;
}

/// s^2 R C R^T, symmetric to the last bit.
Covariance3 moved(const Covariance3& C, const Similarity& S) {
  const Matrix3<double> R = matrix_from_quaternion(S.rotation);
  const double s2 = S.scale * S.scale;
  std::array<double, 9> RC{};
  Covariance3 out{};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) RC[3 * r + c] += R[3 * r + k] * C[3 * k + c];
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = r; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) out[3 * r + c] += s2 * RC[3 * r + k] * R[3 * c + k];
      out[3 * c + r] = out[3 * r + c];
    }
  return out;
}

/// Differences of a Gaussian's blocks from their states: three columns of lengths become
/// s R d, or s d where they are in a camera's frame. Rows of `square_root` take the inverse.
struct Columns {
  std::size_t first = 0;
  Matrix3<double> sR{}, inverse{};
};

Columns columns_at(std::size_t first, const Similarity& S, bool turning) {
  Columns out{.first = first};
  const Matrix3<double> R =
      matrix_from_quaternion(turning ? S.rotation : Quaternion<double>{1, 0, 0, 0});
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      out.sR[3 * r + c] = S.scale * R[3 * r + c];
      out.inverse[3 * r + c] = R[3 * c + r] / S.scale;
    }
  return out;
}

/// v^T M, three numbers in place.
void multiply_row(double* v, const Matrix3<double>& M) {
  const Vector3<double> old{v[0], v[1], v[2]};
  for (std::size_t c = 0; c < 3; ++c) v[c] = old[0] * M[c] + old[1] * M[3 + c] + old[2] * M[6 + c];
}

void move(GaussianPrior& prior, const Similarity& S) {
  using Kind = GaussianPrior::Block::Kind;
  std::vector<Columns> lengths;
  std::size_t columns = 0;
  for (GaussianPrior::Block& block : prior.blocks) {
    std::vector<double>& x = block.state;
    if (block.kind == Kind::pose) {
      const Pose pose = moved({{x[0], x[1], x[2], x[3]}, {x[4], x[5], x[6]}}, S);
      std::copy(pose.rotation.begin(), pose.rotation.end(), x.begin());
      std::copy(pose.translation.begin(), pose.translation.end(), x.begin() + 4);
      lengths.push_back(columns_at(columns, S, false));
      columns += 6;
    } else if (block.kind == Kind::point) {
      const Vector3<double> X = S({x[0], x[1], x[2]});
      std::copy(X.begin(), X.end(), x.begin());
      lengths.push_back(columns_at(columns, S, true));
      columns += 3;
    } else {
      columns += x.size();
    }
  }
  for (const Columns& of : lengths) {
    for (std::size_t i = of.first; i < prior.square_root.size(); i += columns)
      multiply_row(&prior.square_root[i], of.inverse);
    if (prior.mean.empty()) continue;
    const double* m = &prior.mean[of.first];
    const Vector3<double> mean = multiply(of.sR, {m[0], m[1], m[2]});
    std::copy(mean.begin(), mean.end(), &prior.mean[of.first]);
  }
}

void move(RelativePosePrior& prior, const Similarity& S) {
  for (double& t : prior.translation) t *= S.scale;
  for (std::size_t row = 0; row < 6; ++row)
    for (std::size_t k = 0; k < 3; ++k) prior.square_root[6 * row + k] /= S.scale;
}

void move(Terms& terms, const Similarity& S) {
  for (CentrePrior& prior : terms.centres) {
    prior.position = S(prior.position);
    prior.covariance = moved(prior.covariance, S);
    for (double& x : prior.lever_arm) x *= S.scale;
  }
  for (RotationPrior& prior : terms.rotations) prior.rotation = turned(prior.rotation, S);
  for (GravityPrior& prior : terms.gravities)
    if (turns(S)) prior.down = multiply(matrix_from_quaternion(S.rotation), prior.down);
  for (RelativePosePrior& prior : terms.relative_poses) move(prior, S);
  for (PointPrior& prior : terms.points) {
    prior.position = S(prior.position);
    prior.covariance = moved(prior.covariance, S);
  }
  for (DistancePrior& prior : terms.distances) {
    prior.distance *= S.scale;
    prior.sigma *= S.scale;
  }
  for (GaussianPrior& prior : terms.gaussians) move(prior, S);
}

}  // namespace

Vector3<double> Similarity::operator()(const Vector3<double>& X) const {
  Vector3<double> out = multiply(matrix_from_quaternion(rotation), X);
  for (int k = 0; k < 3; ++k) out[k] = scale * out[k] + translation[k];
  return out;
}

Similarity inverse(const Similarity& S) {
  Similarity out{1 / S.scale, conjugate(S.rotation), {}};
  const Vector3<double> back = out(S.translation);
  for (std::size_t k = 0; k < 3; ++k) out.translation[k] = -back[k];
  return out;
}

Pose moved(const Pose& pose, const Similarity& S) {
  Pose out{turned(pose.rotation, S), {}};
  const Vector3<double> shift = multiply(matrix_from_quaternion(out.rotation), S.translation);
  for (std::size_t k = 0; k < 3; ++k) out.translation[k] = S.scale * pose.translation[k] - shift[k];
  return out;
}

void move(Problem& problem, const Similarity& S) {
  if (is_identity(S)) return;
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    double* X = &problem.points[3 * i];
    const Vector3<double> to = S({X[0], X[1], X[2]});
    std::copy(to.begin(), to.end(), X);
  }
  for (Pose& pose : problem.poses) pose = moved(pose, S);
  for (Pose& frame : problem.rigs.rig_from_world) frame = moved(frame, S);
  for (Pose& sensor : problem.rigs.sensor_from_rig)
    for (double& t : sensor.translation) t *= S.scale;
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    if (in_rig(problem.rigs, j)) problem.poses[j] = pose_of(problem, j);
  move(problem.terms, S);
}

}  // namespace sheaf
