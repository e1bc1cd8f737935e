// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "eliminate/kernels.h"
#include "eliminate/reference_rows.h"
#include "geometry/row_metric.h"
#include "rows/reference_row.h"

namespace sheaf {

// What the reference kernels of lenses and of kept rows share: the elimination of one point whose
// observations' rows are known, whatever they are rows of.

/// Normal equations of a point: V = sum Jp^T Jp, g = -sum Jp^T r.
struct PointNormal {
  Matrix3<double> V{};
  Vector3<double> g{};

  void add(const PointRow& row) {
    for (std::size_t e = 0; e < 2; ++e)
      for (std::size_t i = 0; i < 3; ++i) {
        g[i] -= row.point[e][i] * row.r[e];
        for (std::size_t k = 0; k < 3; ++k) V[3 * i + k] += row.point[e][i] * row.point[e][k];
      }
  }
};

/// V + D = L L^T by X, Y and Z, w = L^-1 g; a point that is held has L^-1 = 0.
struct EliminatedPoint {
  Factor3 f;
  Vector3<double> w{}, D{};

  /// at: the point's coordinates, whose D it is.
  EliminatedPoint(const PointNormal& p, const PointCoordinates& at, double lambda, bool held)
      : D(at.damping(p.V, p.g, lambda)) {
    Matrix3<double> A = p.V;
    at.damp(D, 1, A);
    if (!held) f = Factor3::of(A);
    f.held = held;
    w = f.forward(p.g.data());
  }
  double decrease() const { return w[0] * w[0] + w[1] * w[1] + w[2] * w[2]; }
  /// To a lane of kFactorGroup.
  void store(double* out) const {
    std::array<double, factor_group::kFields> all{
        1 / f.l00, f.l10, f.l20, 1 / f.l11, f.l21, 1 / f.l22, w[0], w[1], w[2], D[0], D[1], D[2]};
    if (f.held) all.fill(0);
    for (std::size_t i = 0; i < all.size(); ++i) out[8 * i] = all[i];
  }
};

/// An observation seen through the point's elimination: B = Jp L^-T, M = I - B B^T = Lm Lm^T, and
/// h = Lm^-1 (r + B w).
struct WhitenedRow {
  std::array<Vector3<double>, 2> B;
  double l00, l10, l11;
  std::array<double, 2> h;

  WhitenedRow(const PointRow& row, const EliminatedPoint& p) {
    for (std::size_t e = 0; e < 2; ++e) B[e] = p.f.forward(row.point[e].data());
    std::array<double, 2> q = row.r;
    double m00 = 1, m01 = 0, m11 = 1;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t e = 0; e < 2; ++e) q[e] += B[e][i] * p.w[i];
      m00 -= B[0][i] * B[0][i], m01 -= B[0][i] * B[1][i], m11 -= B[1][i] * B[1][i];
    }
    l00 = std::sqrt(std::max(m00, 1e-20));
    l10 = m01 / l00;
    l11 = std::sqrt(std::max(m11 - l10 * l10, 1e-20));
    h = times_inverse(q);
  }
  /// Lm^T j.
  std::array<double, 2> times_transpose(double j0, double j1) const {
    return {l00 * j0 + l10 * j1, l11 * j1};
  }
  /// Lm^-1 q.
  std::array<double, 2> times_inverse(const std::array<double, 2>& q) const {
    const double first = q[0] / l00;
    return {first, (q[1] - l10 * first) / l11};
  }
};

/// s += Jp^T e.
inline void add_to_point(const PointRow& row, const std::array<double, 2>& e, Vector3<double>& s) {
  for (std::size_t i = 0; i < 3; ++i) s[i] += row.point[0][i] * e[0] + row.point[1][i] * e[1];
}

/// T = Jc^T B, C = Lm^T Jc and h, as records have them.
inline void write_point_records(const PointRow& row, const WhitenedRow& m, double* T, double* C) {
  for (int k = 0; k < 9; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double j0 = row.camera[0][i], j1 = row.camera[1][i];
    for (int c = 0; c < 3; ++c)
      T[t_record::at(c, k)] = j0 * m.B[0][std::size_t(c)] + j1 * m.B[1][std::size_t(c)];
    const std::array<double, 2> column = m.times_transpose(j0, j1);
    for (int e = 0; e < 2; ++e) c_entry(T, C, e, k) = column[std::size_t(e)];
  }
  T[t_record::kRow8 + 3] = 0;
  T[t_record::kH] = m.h[0], T[t_record::kH + 1] = m.h[1];
}

}  // namespace sheaf
