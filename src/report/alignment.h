// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "geometry/rotation.h"

namespace sheaf {

/// Sim(3): X -> s R X + t.
struct Similarity {
  double scale = 1;
  Quaternion<double> rotation{1, 0, 0, 0};
  Vector3<double> translation{0, 0, 0};

  Vector3<double> operator()(const Vector3<double>& X) const;
};

struct Alignment {
  Similarity similarity;
  /// How well the points determine the rotation, from 0 (not at all: fewer than three places, or
  /// places on a line) to about 1: the relative distance of the two largest eigenvalues.
  double certainty = 0;
};

/// The similarity that minimises sum |to_i - S(from_i)|^2 (Horn 1987: the rotation is the largest
/// eigenvector of a symmetric 4x4 matrix). The scale is 1 where `from` is a single place.
Alignment align(const std::vector<Vector3<double>>& from, const std::vector<Vector3<double>>& to);

}  // namespace sheaf
