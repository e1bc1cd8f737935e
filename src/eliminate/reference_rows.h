// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "eliminate/kernels.h"
#include "geometry/bal_camera.h"
#include "geometry/row_metric.h"

namespace sheaf {

// What the reference kernels share: one observation, one point, in plain scalar code.

struct Observed {
  Matrix3<double> R;
  Vector3<double> t;
  BalCamera<double> camera;
};

inline Observed camera_at(const double* c) {
  Observed o;
  std::copy(c, c + 9, o.R.begin());
  std::copy_n(c + camera_record::kTranslation, 3, o.t.begin());
  const double* lens = c + camera_record::kFocal;
  o.camera = {lens[0], lens[1], lens[2]};
  return o;
}
inline Observed camera_of(const double* cameras, std::uint32_t image) {
  return camera_at(cameras + kCameraRecord * image);
}

inline Vector3<double> point_of(const double* points, std::size_t group, std::uint32_t lane) {
  const double* X = points + kPointGroup * group + lane;
  return {X[0], X[8], X[16]};
}

/// One observation with its residual and the exact Jacobians.
struct Row {
  std::array<double, 2> r;
  BalJacobian<double> j;

  double square() const { return r[0] * r[0] + r[1] * r[1]; }
  template <class Visit>
  void visit_columns(const Visit& visit) {
    for (std::size_t k = 0; k < 9; ++k) visit(j.camera[k], j.camera[9 + k]);
    for (std::size_t k = 0; k < 3; ++k) visit(j.point[k], j.point[3 + k]);
  }
};

inline Row row_of(const Batches& batches, const double* cameras, const Vector3<double>& X,
                  std::uint64_t batch, std::uint32_t lane) {
  const Observed o = camera_of(cameras, batches.image[8 * batch + lane]);
  Row row;
  row.j = project_with_jacobian(o.R, o.t, o.camera, X);
  row.r = {row.j.pixel[0] - batches.xy[16 * batch + lane],
           row.j.pixel[1] - batches.xy[16 * batch + 8 + lane]};
  return row;
}

/// Lower factor L of V + D, with the solve by L.
struct Factor3 {
  double l00 = 0, l10 = 0, l20 = 0, l11 = 0, l21 = 0, l22 = 0;
  bool held = false;

  static Factor3 of(const std::array<double, 9>& A) {
    Factor3 f;
    f.l00 = std::sqrt(A[0]);
    f.l10 = A[3] / f.l00;
    f.l20 = A[6] / f.l00;
    f.l11 = std::sqrt(A[4] - f.l10 * f.l10);
    f.l21 = (A[7] - f.l10 * f.l20) / f.l11;
    f.l22 = std::sqrt(A[8] - f.l20 * f.l20 - f.l21 * f.l21);
    return f;
  }
  Vector3<double> forward(const double* s) const {
    if (held) return {0, 0, 0};
    Vector3<double> y;
    y[0] = s[0] / l00;
    y[1] = (s[1] - l10 * y[0]) / l11;
    y[2] = (s[2] - l20 * y[0] - l21 * y[1]) / l22;
    return y;
  }
  Vector3<double> backward(const Vector3<double>& y) const {
    Vector3<double> x;
    x[2] = y[2] / l22;
    x[1] = (y[1] - l21 * x[2]) / l11;
    x[0] = (y[0] - l10 * x[1] - l20 * x[2]) / l00;
    return x;
  }
};

/// Entry k of C's rows: 8 + 1 storage undone.
template <class Number>
Number& c_entry(Number* T, Number* C, int row, int k) {
  return k < 8 ? C[c_record::row(row) + k] : T[t_record::kC8 + row];
}

/// The base of a point's chart.
inline Vector3<double> base_of(const ChartRules& rules, const Batches& batches,
                               const Batches::Group& group, std::uint32_t lane,
                               const double* cameras) {
  if (rules.base != ChartBase::host) return rules.origin;
  const Observed o = camera_of(cameras, batches.image[8 * group.first_batch + lane]);
  Vector3<double> C{};
  for (int k = 0; k < 3; ++k)
    for (int r = 0; r < 3; ++r) C[k] -= o.R[3 * r + k] * o.t[r];
  return C;
}

/// The chart of the point X about a base; without charts its coordinates are X, Y and Z.
struct PointCoordinates {
  const ChartRules& rules;
  Vector3<double> base;
  PointChart<double> chart;

  PointCoordinates(const ChartRules& chosen, const Vector3<double>& about, const Vector3<double>& X)
      : rules(chosen),
        base(about),
        chart(chosen, {X[0] - base[0], X[1] - base[1], X[2] - base[2]}) {}

  bool plain() const { return rules.base == ChartBase::none; }
  Vector3<double> of(const Vector3<double>& d) const { return plain() ? d : chart.coordinates(d); }
  /// diag(E^T V E), E = dX/dq.
  Vector3<double> diagonal(const Matrix3<double>& V) const {
    Vector3<double> out{V[0], V[4], V[8]};
    for (int i = 0; !plain() && i < 3; ++i) {
      Vector3<double> q{};
      q[i] = 1;
      const Vector3<double> e = chart.apply(q), Ve = multiply(V, e);
      out[i] = e[0] * Ve[0] + e[1] * Ve[1] + e[2] * Ve[2];
    }
    return out;
  }
  /// Marquardt's, of the coordinates: lambda diag(E^T V E), clamped; more where rounding would pass
  /// for parallax, and where the point is at its bound (ChartRules).
  Vector3<double> damping(const Matrix3<double>& V, const Vector3<double>& gradient,
                          double lambda) const {
    const Vector3<double> v = diagonal(V);
    Vector3<double> D;
    for (std::size_t i = 0; i < 3; ++i)
      D[i] = lambda * std::clamp(v[i], kDiagonalFloor, kDiagonalCeiling);
    if (plain()) return D;
    const double least = rules.rounding * rules.unit;
    D[2] = std::max(D[2], least * least * chart.reach2 * (v[0] + v[1]));
    if (!rules.crosses && chart.reach * rules.unit > kBound && chart.transpose(gradient)[2] > 0)
      D[2] = std::max(D[2], kAtBound * std::clamp(v[2], kDiagonalFloor, kDiagonalCeiling));
    return D;
  }
  /// A += E^-T D E^-1.
  void damp(const Vector3<double>& D, double by, Matrix3<double>& A) const {
    Vector3<double> column[3];
    for (int i = 0; i < 3; ++i) {
      Vector3<double> d{};
      d[i] = 1;
      column[i] = of(d);
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) A[3 * i + j] += by * column[i][k] * D[k] * column[j][k];
  }
  /// Where the point ends after the step d, its base having moved.
  Vector3<double> step(const Vector3<double>& d, const Vector3<double>& moved) const {
    Vector3<double> e, out;
    for (int k = 0; k < 3; ++k) e[k] = d[k] - (moved[k] - base[k]);
    if (!plain()) e = chart.retract(rules, e);
    for (int k = 0; k < 3; ++k) out[k] = plain() ? base[k] + chart.Y[k] + d[k] : moved[k] + e[k];
    return out;
  }
};

/// The columns of the step in a camera record.
inline std::array<double, 9> step_of(const double* record) {
  const double *lens = record + camera_record::kFocal, *rho = record + camera_record::kRho;
  const double *phi = record + camera_record::kPhi, *s = record + camera_record::kRadial;
  const double dk1 = (s[1] - lens[1] * s[0]) / lens[0], dk2 = (s[2] - lens[2] * s[0]) / lens[0];
  return {rho[0], rho[1], rho[2], phi[0], phi[1], phi[2], s[0], dk1, dk2};
}

/// Jc dc, from the step in the camera record.
inline std::array<double, 2> camera_motion(const Row& row, const double* record) {
  const std::array<double, 9> dc = step_of(record);
  std::array<double, 2> e{};
  for (int r = 0; r < 2; ++r)
    for (int k = 0; k < 9; ++k) e[r] += row.j.camera[9 * r + k] * dc[k];
  return e;
}

inline RowMetric metric_at(const double* metric, std::uint64_t batch, std::uint32_t lane) {
  if (metric == nullptr) return {};
  const double* at = metric + kMetricBatch * batch + lane;
  return {at[metric_batch::kWeight], {at[metric_batch::kAlong], at[metric_batch::kAlong + 8]}};
}
inline void store_metric(const RowMetric& m, double* metric, std::uint64_t batch,
                         std::uint32_t lane) {
  double* at = metric + kMetricBatch * batch + lane;
  at[metric_batch::kWeight] = m.w;
  for (std::size_t e = 0; e < 2; ++e) at[metric_batch::kAlong + 8 * e] = m.u[e];
}

inline double inverse_sigma_at(const Batches& batches, std::uint64_t batch, std::uint32_t lane) {
  return batches.inverse_sigma.size() == 0 ? 1 : batches.inverse_sigma[8 * batch + lane];
}

/// A point's own rows at X: V += U^T U, g -= U^T r with r = U (X - mean). Returns |r|^2.
inline double add_prior(const Batches& batches, std::size_t g, std::uint32_t lane,
                        const Vector3<double>& X, Matrix3<double>& V, Vector3<double>& gradient) {
  if (batches.prior.size() == 0) return 0;
  const double* at = &batches.prior[kPointPrior * g + lane];
  const auto u = [at](int i) { return at[point_prior::root(i)]; };
  const Matrix3<double> U{u(0), u(1), u(2), 0, u(3), u(4), 0, 0, u(5)};
  double square = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    double r = 0;
    for (std::size_t i = 0; i < 3; ++i)
      r += U[3 * k + i] * (X[i] - at[point_prior::mean(static_cast<int>(i))]);
    square += r * r;
    for (std::size_t i = 0; i < 3; ++i) {
      gradient[i] -= U[3 * k + i] * r;
      for (std::size_t c = 0; c < 3; ++c) V[3 * i + c] += U[3 * k + i] * U[3 * k + c];
    }
  }
  return square;
}
/// |U v|^2.
inline double prior_curvature(const Batches& batches, std::size_t g, std::uint32_t lane,
                              const Vector3<double>& v) {
  Matrix3<double> V{};
  Vector3<double> unused{};
  add_prior(batches, g, lane, v, V, unused);
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) sum += v[i] * V[3 * i + k] * v[k];
  return sum;
}

/// less += (Jp^T u) (Jp^T u)^T: what a loss's metric takes from V by its weight alone. point: Jp,
/// row by row.
inline void add_less(const RowMetric& metric, const double* point, Matrix3<double>& less) {
  Vector3<double> a;
  for (std::size_t i = 0; i < 3; ++i) a[i] = metric.u[0] * point[i] + metric.u[1] * point[3 + i];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) less[3 * i + k] += a[i] * a[k];
}

/// The largest |J_i^T r|^2 / |J_i|^2 of a point's column, J by the weight of the loss alone.
inline double gradient_by_weight(const PointCoordinates& at, const Matrix3<double>& V,
                                 const Matrix3<double>& less, const Vector3<double>& g) {
  Matrix3<double> A = V;
  for (std::size_t i = 0; i < 9; ++i) A[i] += less[i];
  const Vector3<double> norm2 = at.diagonal(A);
  const Vector3<double> gradient = at.plain() ? g : at.chart.transpose(g);
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i)
    most = std::max(most, gradient[i] * gradient[i] / std::max(norm2[i], 1e-300));
  return most;
}

/// The largest of the common damping and the point's own.
inline double damping_of_point(double common, const double* own, std::size_t g,
                               std::uint32_t lane) {
  return own == nullptr ? common : std::max(common, own[8 * g + lane]);
}

/// s += Jp^T e.
inline void add_to_point(const Row& row, const std::array<double, 2>& e, Vector3<double>& s) {
  for (int i = 0; i < 3; ++i) s[i] += row.j.point[i] * e[0] + row.j.point[3 + i] * e[1];
}

inline Vector3<double> back_substitute(const double* factor, const Vector3<double>& s) {
  const auto at = [&](int i) { return factor[8 * i]; };
  const double u0 = s[0] * at(0);
  const double u1 = (s[1] - at(1) * u0) * at(3);
  const double u2 = (s[2] - at(2) * u0 - at(4) * u1) * at(5);
  const double v0 = at(6) - u0, v1 = at(7) - u1, v2 = at(8) - u2;
  Vector3<double> d;
  d[2] = v2 * at(5);
  d[1] = (v1 - at(4) * d[2]) * at(3);
  d[0] = (v0 - at(1) * d[1] - at(2) * d[2]) * at(0);
  return d;
}

inline double depth(const double* cameras, std::uint32_t image, const Vector3<double>& X) {
  const Observed o = camera_of(cameras, image);
  return multiply(o.R, X)[2] + o.t[2];
}

/// The kernel `trial` (eliminate/kernels.h).
void trial_by_reference(const TrialInput& in, const Chunk& chunk, TrialOutput& out);

}  // namespace sheaf
