// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Sim(3): X -> s R X + t.
struct Similarity {
  double scale = 1;  ///< above 0
  Quaternion<double> rotation{1, 0, 0, 0};
  Vector3<double> translation{0, 0, 0};

  Vector3<double> operator()(const Vector3<double>& X) const;
};

/// S^-1: X -> R^T (X - t) / s.
Similarity inverse(const Similarity& S);

/// The pose that sees S(X) where `pose` sees X, s times as far away: R_cam R^T and
/// s t_cam - R_cam R^T t. Its rotation is the same bit for bit where that of S is the identity.
Pose moved(const Pose& pose, const Similarity& S);

/// Moves the world of a problem: each point X becomes S(X); poses, frames and terms follow, and
/// lengths (sensors' translations, lever arms, distances, sigmas) are scaled, so that residuals and
/// what terms cost stay what they are. Lenses and pixels are not touched. Images of rigs are placed
/// where their frames and sensors say. Rotations as a file stated them hold no longer where S turns
/// (their quaternions differ), and still do where it does not. The identity changes no bit.
void move(Problem& problem, const Similarity& S);

}  // namespace sheaf
