// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/rotation.h"

namespace sheaf {

/// The rotation that turns one set of vectors best into another.
struct BestRotation {
  Quaternion<double> rotation{1, 0, 0, 0};
  double trace = 0;  ///< of R S, at its largest
  /// How well the vectors determine it, from 0 (not at all: all on a line, or none) to about 1: the
  /// relative distance of the two largest eigenvalues.
  double certainty = 0;
};

/// R that minimises sum w_i |to_i - R from_i|^2, from S = sum w_i from_i to_i^T, row-major. The
/// rotation is the largest eigenvector of a symmetric 4x4 matrix (Horn 1987).
BestRotation best_rotation(const Matrix3<double>& S);

}  // namespace sheaf
