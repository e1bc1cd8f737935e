// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "platform/random.h"
#include "scene/portable_rotation.h"
#include "sheaf/photometric.h"

namespace sheaf {
namespace {

enum Stream : std::uint64_t { kTurns = 201, kMoves = 202 };

Vector3<double> minus(const Vector3<double>& a, const Vector3<double>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// R^T v.
Vector3<double> turn_back(const Matrix3<double>& R, const Vector3<double>& v) {
  return {R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
          R[2] * v[0] + R[5] * v[1] + R[8] * v[2]};
}

/// A vector of this length, every direction equally likely.
Vector3<double> any_direction(Random& random, double length) {
  Vector3<double> v;
  double norm = 0;
  while (!(norm > 1e-3)) {
    for (double& c : v) c = random.normal();
    norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  for (double& c : v) c *= length / norm;
  return v;
}

Pose moved(const Pose& pose, const Vector3<double>& turn, const Vector3<double>& move) {
  const Vector3<double> from = turn_back(portable_matrix(pose.rotation), pose.translation);
  Pose out;
  out.rotation = normalized(multiply(portable_quaternion(turn), pose.rotation));
  // t = -R C with C = -from + move
  out.translation = multiply(portable_matrix(out.rotation), minus(from, move));
  return out;
}

}  // namespace

Result<void> disturb(PhotometricProblem& problem, const PoseNoise& noise) {
  for (double size : {noise.rotation_rad, noise.center})
    if (!(size >= 0) || !std::isfinite(size))
      return Error(ErrorCode::usage, "how far poses are disturbed is a finite number from 0 up");
  const std::vector<Pose> before = problem.poses;
  Random turns(noise.seed, kTurns), moves(noise.seed, kMoves);
  for (Pose& pose : problem.poses)
    pose =
        moved(pose, any_direction(turns, noise.rotation_rad), any_direction(moves, noise.center));
  for (std::size_t i = 0; i < problem.host.size(); ++i) {
    const Pose &was = before[problem.host[i]], &is = problem.poses[problem.host[i]];
    double* X = &problem.points[3 * i];
    Vector3<double> P = multiply(portable_matrix(was.rotation), Vector3<double>{X[0], X[1], X[2]});
    for (int d = 0; d < 3; ++d) P[d] += was.translation[d] - is.translation[d];
    P = turn_back(portable_matrix(is.rotation), P);
    for (int d = 0; d < 3; ++d) X[d] = P[d];
  }
  return {};
}

}  // namespace sheaf
