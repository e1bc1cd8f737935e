// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "geometry/loss.h"
#include "geometry/point_chart.h"
#include "geometry/rigid_motion.h"
#include "sheaf/options.h"
#include "sheaf/problem.h"

// A step by the textbook: the whole Jacobian's normal equations as a dense matrix, cameras and
// points together, no elimination.
namespace sheaf {

/// Where the parameters of a problem stand in the textbook's vector; -1: held.
struct Places {
  std::vector<int> pose, lens, point;  ///< 6 per image, kMaxCameraParameters per lens, 3 per point
  int count = 0;

  Places(const Problem& p, const Fixed& fixed);
};

/// The coordinates that the textbook's points step in.
struct Charts {
  ChartRules rules;
  std::vector<std::uint32_t> host;  ///< first image that sees the point

  explicit Charts(const Problem& p, PointParametrisation points = PointParametrisation::xyz);
  Vector3<double> base(const Problem& p, std::size_t point) const;
  PointChart<double> at(const Problem& p, std::size_t point) const;
};

/// A = J^T J, row-major, and b = -J^T r.
struct Normal {
  std::vector<double> A, b;
  double cost = 0;

  Normal(const Problem& p, const Places& at, const ScaledLoss& loss, const Charts& charts);
  void add_row(const std::vector<std::pair<int, double>>& entries, double r);
};

/// Solves A x = b for a symmetric positive definite A, by elimination without pivoting.
std::vector<double> solve_dense(std::vector<double> A, std::vector<double> b);

/// Steps every free parameter by x.
void move(Problem& p, const Places& at, const std::vector<double>& x, const Charts& charts);

/// One step of `solve` with this damping against the textbook's: cost, trial cost, predicted
/// decrease and, where it is accepted, the state.
void expect_textbook_step(const Problem& start, const Fixed& fixed, double damping,
                          const Loss& loss = {},
                          PointParametrisation points = PointParametrisation::xyz,
                          CameraSolverKind solver = CameraSolverKind::automatic);

inline Fixed points_held() {
  Fixed fixed;
  fixed.points = true;
  return fixed;
}

/// Only what the first `points` points contribute: small enough for the textbook.
Problem first_points(const Problem& p, std::uint32_t points);

}  // namespace sheaf
