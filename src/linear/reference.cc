// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels once more as plain scalar code, one observation at a time: what the fast ones are
// tested against. Written for reading, not for speed.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "geometry/bal_camera.h"
#include "linear/kernel_table.h"

namespace sheaf {
namespace {

struct Observed {
  Matrix3<double> R;
  Vector3<double> t;
  BalCamera<double> camera;
};

Observed camera_of(const double* cameras, std::uint32_t image) {
  const double* c = cameras + kCameraRecord * image;
  Observed o;
  std::copy(c, c + 9, o.R.begin());
  std::copy(c + 9, c + 12, o.t.begin());
  o.camera = {c[12], c[13], c[14]};
  return o;
}

Vector3<double> point_of(const double* points, std::size_t group, std::uint32_t lane) {
  const double* X = points + kPointGroup * group + lane;
  return {X[0], X[8], X[16]};
}

/// One observation with its residual and the exact Jacobians.
struct Row {
  std::array<double, 2> r;
  BalJacobian<double> j;

  double square() const { return r[0] * r[0] + r[1] * r[1]; }
  /// Times sqrt(rho'); returns rho of what it was.
  LossValue<double> apply(const ScaledLoss& loss) {
    const LossValue<double> rho = evaluate_loss(loss, square());
    scale(std::sqrt(rho.first));
    return rho;
  }
  void scale(double by) {
    for (double& x : r) x *= by;
    for (double& x : j.camera) x *= by;
    for (double& x : j.point) x *= by;
  }
};

Row row_of(const Batches& batches, const double* cameras, const Vector3<double>& X,
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

void store_factor(const Factor3& f, const Vector3<double>& w, const Vector3<double>& D,
                  double* out) {
  std::array<double, 12> all{1 / f.l00, f.l10, f.l20, 1 / f.l11, f.l21, 1 / f.l22,
                             w[0],      w[1],  w[2],  D[0],      D[1],  D[2]};
  if (f.held) all.fill(0);
  for (int i = 0; i < 12; ++i) out[8 * i] = all[i];
}

void write_record(const Row& row, const Factor3& f, const Vector3<double>& w, double* T,
                  double* C) {
  const auto& Jc = row.j.camera;
  const Vector3<double> B0 = f.forward(&row.j.point[0]), B1 = f.forward(&row.j.point[3]);
  double q[2] = {row.r[0], row.r[1]}, m00 = 1, m01 = 0, m11 = 1;
  for (int i = 0; i < 3; ++i) {
    q[0] += B0[i] * w[i], q[1] += B1[i] * w[i];
    m00 -= B0[i] * B0[i], m01 -= B0[i] * B1[i], m11 -= B1[i] * B1[i];
  }
  const double l00 = std::sqrt(std::max(m00, 1e-20)), l10 = m01 / l00;
  const double l11 = std::sqrt(std::max(m11 - l10 * l10, 1e-20));
  for (int k = 0; k < 9; ++k) {
    const double c0 = l00 * Jc[k] + l10 * Jc[9 + k], c1 = l11 * Jc[9 + k];
    (k < 8 ? C[k] : T[28]) = c0;
    (k < 8 ? C[8 + k] : T[29]) = c1;
    for (int i = 0; i < 3; ++i)
      (k < 8 ? T[8 * i + k] : T[24 + i]) = Jc[k] * B0[i] + Jc[9 + k] * B1[i];
  }
  T[27] = 0;
  T[30] = q[0] / l00;
  T[31] = (q[1] - l10 * T[30]) / l11;
}

void eliminate_point(const EliminateInput& in, const Chunk& chunk, std::size_t g,
                     std::uint32_t lane, double* T, double* C, EliminateOutput& out) {
  const Batches::Group& group = in.batches->groups[g];
  const Vector3<double> X = point_of(in.points, g, lane);
  std::array<double, 9> A{};
  Vector3<double> gradient{}, D;
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    Row row = row_of(*in.batches, in.cameras, X, b, lane);
    out.square_sum += row.square();
    if (in.loss.kind != LossKind::none) {
      const LossValue<double> rho = row.apply(in.loss);
      out.loss_sum += rho.value;
      out.weights[8 * b + lane] = rho.first;
    }
    for (int e = 0; e < 2; ++e)
      for (int i = 0; i < 3; ++i) {
        gradient[i] -= row.j.point[3 * e + i] * row.r[e];
        for (int k = 0; k < 3; ++k) A[3 * i + k] += row.j.point[3 * e + i] * row.j.point[3 * e + k];
      }
  }
  for (int i = 0; i < 3; ++i) {
    D[i] = in.damping * std::clamp(A[4 * i], kDiagonalFloor, kDiagonalCeiling);
    A[4 * i] += D[i];
  }
  Factor3 f = Factor3::of(A);
  f.held = in.points_held;
  const Vector3<double> w = f.forward(gradient.data());
  const double w2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  out.point_decrease += w2;
  out.gradient_max2 = std::max(out.gradient_max2, w2);
  store_factor(f, w, D, out.factors + kFactorGroup * g + lane);
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const std::uint64_t record = 8 * (b - chunk.first_batch) + lane;
    Row row = row_of(*in.batches, in.cameras, X, b, lane);
    if (in.loss.kind != LossKind::none) row.scale(std::sqrt(out.weights[8 * b + lane]));
    write_record(row, f, w, T + kTRecord * record, C + kCRecord * record);
  }
}

/// Entry k of the three columns of T, and of the two rows of C: 8 + 1 storage undone.
double t_entry(const double* T, int column, int k) {
  return k < 8 ? T[8 * column + k] : T[24 + column];
}
double c_entry(const double* T, const double* C, int row, int k) {
  return k < 8 ? C[8 * row + k] : T[28 + row];
}

void add_diagonal(const double* T, const double* C, double* to) {
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k < 9; ++k) {
      const double s =
          c_entry(T, C, 0, i) * c_entry(T, C, 0, k) + c_entry(T, C, 1, i) * c_entry(T, C, 1, k);
      if (k < 8) to[8 * i + k] += s;
      if (k == 8 && i == 8) to[88] += s;
    }
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += t_entry(T, c, i) * t_entry(T, c, i);
    const double rhs = c_entry(T, C, 0, i) * T[30] + c_entry(T, C, 1, i) * T[31];
    to[i < 8 ? 72 + i : 89] += rhs;
    to[i < 8 ? 80 + i : 90] += squares;
  }
}

void add_pair(const double* Ta, const double* Tb, double* tile) {
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 9; ++k) {
      double s = 0;
      for (int c = 0; c < 3; ++c) s += t_entry(Ta, c, i) * t_entry(Tb, c, k);
      tile[k < 8 ? 8 * i + k : (i < 8 ? 72 + i : 80)] += s;
    }
}

void linearize(const EliminateInput& in, const Chunk& chunk, const Records& records,
               EliminateOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.batches->groups[g].lanes; ++l)
      eliminate_point(in, chunk, g, l, records.T, records.C, out);
}

void diagonal_in_order(const Batches& batches, const Chunk& chunk, const Records& records,
                       double* sums) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t o = 0; o < batches.groups[g].track; ++o)
      for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l) {
        const std::uint64_t b = batches.groups[g].first_batch + o;
        const std::uint64_t record = 8 * (b - chunk.first_batch) + l;
        add_diagonal(records.T + kTRecord * record, records.C + kCRecord * record,
                     sums + kDiagonalDoubles * batches.image[8 * b + l]);
      }
}

void diagonal(const Batches& batches, const Chunks& chunks, const Chunk& chunk,
              const Records& records, double* sums) {
  if (chunks.diagonal.size() == 0) return diagonal_in_order(batches, chunk, records, sums);
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun& run = chunks.diagonal_runs[i];
    for (std::uint64_t r = run.first; r < run.first + run.count; ++r) {
      const std::size_t record = chunks.diagonal[r];
      add_diagonal(records.T + kTRecord * record, records.C + kCRecord * record,
                   sums + kDiagonalDoubles * run.image);
    }
  }
}

void pairs(const Chunks& chunks, const Chunk& chunk, const Records& records, double* tiles) {
  for (std::uint64_t i = chunk.first_pair_run; i < chunk.end_pair_run; ++i) {
    const PairRun& run = chunks.pair_runs[i];
    for (std::uint64_t r = run.first; r < run.first + run.count; ++r)
      add_pair(records.T + kTRecord * chunks.pairs[r].a, records.T + kTRecord * chunks.pairs[r].b,
               tiles + kTileDoubles * run.tile);
  }
}

/// Jc dc, from the step in the camera record: phi, rho, df, k1 df + f dk1, k2 df + f dk2.
std::array<double, 2> camera_motion(const Row& row, const double* record) {
  const double* s = record + camera_record::kStep;
  const double f = record[12];
  const double dk1 = (s[7] - record[13] * s[6]) / f, dk2 = (s[8] - record[14] * s[6]) / f;
  const std::array<double, 9> dc{s[3], s[4], s[5], s[0], s[1], s[2], s[6], dk1, dk2};
  std::array<double, 2> e{};
  for (int r = 0; r < 2; ++r)
    for (int k = 0; k < 9; ++k) e[r] += row.j.camera[9 * r + k] * dc[k];
  return e;
}

double weight_of(const double* weights, std::uint64_t batch, std::uint32_t lane) {
  return weights == nullptr ? 1 : weights[8 * batch + lane];
}

/// s += Jp^T w e.
void add_to_point(const Row& row, double w, const std::array<double, 2>& e, Vector3<double>& s) {
  for (int i = 0; i < 3; ++i) s[i] += w * (row.j.point[i] * e[0] + row.j.point[3 + i] * e[1]);
}

Vector3<double> back_substitute(const double* factor, const Vector3<double>& s) {
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

struct PointCost {
  double square = 0, cost = 0;
  Matrix3<double> V{};
  Vector3<double> g{};
};

PointCost cost_of(const TrialInput& in, const Batches::Group& group, const Vector3<double>& X,
                  std::uint32_t lane) {
  PointCost out;
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    Row row = row_of(*in.batches, in.trial_cameras, X, b, lane);
    out.square += row.square();
    out.cost += row.apply(in.loss).value;
    for (int r = 0; r < 2; ++r) {
      const double* J = &row.j.point[3 * r];
      for (int i = 0; i < 3; ++i) {
        out.g[i] -= J[i] * row.r[r];
        for (int k = 0; k < 3; ++k) out.V[3 * i + k] += J[i] * J[k];
      }
    }
  }
  return out;
}

/// Inner iterations (kernels.h) of one point from X; returns the cost where it ends.
PointCost refine_point(const TrialInput& in, const Batches::Group& group, std::uint32_t lane,
                       const double* factor, Vector3<double>& X) {
  PointCost best = cost_of(in, group, X, lane);
  const double mean = in.mean_square * group.track;
  for (int step = 0; step < in.inner_iterations; ++step) {
    Matrix3<double> A = best.V;
    for (int i = 0; i < 3; ++i) A[4 * i] += inner_iterations::kDamping * factor[8 * (9 + i)];
    const Factor3 f = Factor3::of(A);
    const Vector3<double> w = f.forward(best.g.data());
    const double decrease = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(decrease > inner_iterations::kWorthOne * mean)) break;
    const Vector3<double> d = f.backward(w);
    const Vector3<double> Y{X[0] + d[0], X[1] + d[1], X[2] + d[2]};
    const PointCost there = cost_of(in, group, Y, lane);
    if (!(there.cost < best.cost)) break;
    X = Y, best = there;
    if (!(decrease > inner_iterations::kWorthMore * mean)) break;
  }
  return best;
}

double depth(const double* cameras, std::uint32_t image, const Vector3<double>& X) {
  const Observed o = camera_of(cameras, image);
  return multiply(o.R, X)[2] + o.t[2];
}

/// Every ordered pair of records of a point, as it stands in the text.
void coarse(const Batches& batches, const Chunk& chunk, const Records& records,
            const CoarseInput& in, double*, double* sums) {
  const auto projected = [&](std::size_t record, std::uint32_t image, int q, int m) {
    double sum = 0;
    for (int r = 0; r < 7; ++r)
      sum += records.T[kTRecord * record + 8 * q + r] * in.basis[kCoarseBasis * image + 8 * r + m];
    return sum;
  };
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    for (std::uint32_t l = 0; l < group.lanes; ++l)
      for (std::uint32_t a = 0; a < group.track; ++a)
        for (std::uint32_t b = 0; b < group.track; ++b) {
          const std::uint32_t image_a = batches.image[8 * (group.first_batch + a) + l];
          const std::uint32_t image_b = batches.image[8 * (group.first_batch + b) + l];
          const std::int32_t row = in.cluster[image_a], column = in.cluster[image_b];
          if (a == b || column < 0 || row < column) continue;
          double* tile = sums + kCoarseTile * in.tile[std::size_t(row) * (row + 1) / 2 + column];
          const std::size_t first = 8 * (group.first_batch - chunk.first_batch) + l;
          for (int m = 0; m < 8; ++m)
            for (int n = 0; n < 8; ++n)
              for (int q = 0; q < 3; ++q)
                tile[8 * m + n] += projected(first + 8 * a, image_a, q, m) *
                                   projected(first + 8 * b, image_b, q, n);
        }
  }
}

void trial_point(const TrialInput& in, std::size_t g, std::uint32_t lane, TrialOutput& out) {
  const Batches& batches = *in.batches;
  const Batches::Group& group = batches.groups[g];
  const bool real = lane < group.lanes;
  const Vector3<double> X = point_of(in.points, g, lane);
  Vector3<double> s{};
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const Row row = row_of(batches, in.cameras, X, b, lane);
    const auto e = camera_motion(row, in.cameras + kCameraRecord * batches.image[8 * b + lane]);
    add_to_point(row, weight_of(in.weights, b, lane), e, s);
  }
  const double* factor = in.factors + kFactorGroup * g + lane;
  const Vector3<double> d = real ? back_substitute(factor, s) : Vector3<double>{};
  Vector3<double> Y{X[0] + d[0], X[1] + d[1], X[2] + d[2]};
  const PointCost cost = real ? refine_point(in, group, lane, factor, Y) : PointCost();
  double d2 = 0, x2 = 1e-300;
  for (int i = 0; i < 3; ++i) {
    out.points[kPointGroup * g + 8 * i + lane] = Y[i];
    d2 += (Y[i] - X[i]) * (Y[i] - X[i]), x2 += X[i] * X[i];
    if (real) out.damping_term += d[i] * d[i] * factor[8 * (9 + i)];
  }
  if (!real) return;
  out.step2_max = std::max(out.step2_max, d2 / x2);
  out.square_sum += cost.square;
  if (in.loss.kind != LossKind::none) out.loss_sum += cost.cost;
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const std::uint32_t image = batches.image[8 * b + lane];
    if (in.count_newly_behind && depth(in.trial_cameras, image, Y) > 0 &&
        depth(in.cameras, image, X) <= 0)
      ++out.newly_behind;
  }
}

void trial(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) trial_point(in, g, l, out);
}

void product_point(const ProductInput& in, std::size_t g, std::uint32_t lane, double* y) {
  const Batches& batches = *in.batches;
  const Batches::Group& group = batches.groups[g];
  const Vector3<double> X = point_of(in.points, g, lane);
  const double* factor = in.factors + kFactorGroup * g + lane;
  Vector3<double> s{};
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const Row row = row_of(batches, in.cameras, X, b, lane);
    const auto e = camera_motion(row, in.cameras + kCameraRecord * batches.image[8 * b + lane]);
    add_to_point(row, weight_of(in.weights, b, lane), e, s);
  }
  // back_substitute gives L^-T (w - L^-1 s): taken from that of s = 0, (V + D)^-1 s is left.
  const Vector3<double> with = back_substitute(factor, s), without = back_substitute(factor, {});
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const std::uint32_t image = batches.image[8 * b + lane];
    const double* record = in.cameras + kCameraRecord * image;
    const Row row = row_of(batches, in.cameras, X, b, lane);
    auto e = camera_motion(row, record);
    for (int r = 0; r < 2; ++r)
      for (int i = 0; i < 3; ++i) e[r] -= row.j.point[3 * r + i] * (without[i] - with[i]);
    const double w = weight_of(in.weights, b, lane);
    std::array<double, 9> v{};
    for (int r = 0; r < 2; ++r)
      for (int k = 0; k < 9; ++k) v[k] += w * row.j.camera[9 * r + k] * e[r];
    v[7] /= record[12], v[8] /= record[12];  // to the sums s n, s n^2, and s from y_f
    v[6] -= record[13] * v[7] + record[14] * v[8];
    for (int k = 0; k < 9; ++k) y[kProductRecord * image + k] += v[k];
  }
}

void product(const ProductInput& in, const Chunk& chunk, double*, double* y) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.batches->groups[g].lanes; ++l) product_point(in, g, l, y);
}

void residuals(const Batches& batches, const double* cameras, const double* points,
               const Chunk& chunk, double* out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l)
      for (std::uint32_t o = 0; o < batches.groups[g].track; ++o) {
        const std::uint64_t b = batches.groups[g].first_batch + o;
        const Row row = row_of(batches, cameras, point_of(points, g, l), b, l);
        for (int e = 0; e < 2; ++e)
          out[16 * (b - chunk.first_batch) + 8 * e + l] = std::abs(row.r[e]);
      }
}

/// In double: points and factors as the scaled lengths have them, cameras as they were rounded.
void product_float(const FloatProductInput& in, const Chunk& chunk, float*, double* y) {
  std::size_t images = 0;
  for (std::size_t b = 8 * chunk.first_batch; b < 8 * chunk.end_batch; ++b)
    images = std::max(images, std::size_t{1} + in.batches->image[b]);
  std::vector<double> cameras(kCameraRecord * images);
  for (std::size_t i = 0; i < images; ++i)
    std::copy_n(in.cameras + kFloatCameraRecord * i, kCameraRecord, &cameras[kCameraRecord * i]);
  std::vector<double> points(kPointGroup * chunk.end_group);
  std::vector<double> factors(kFactorGroup * chunk.end_group);
  for (std::size_t i = kPointGroup * chunk.first_group; i < points.size(); ++i)
    points[i] = (in.points[i] - in.origin[i / 8 % 3]) * in.scale;
  for (std::size_t i = kFactorGroup * chunk.first_group; i < factors.size(); ++i) {
    const std::size_t field = i / 8 % 12;
    const bool inverse = field == 0 || field == 3 || field == 5;
    factors[i] = in.factors[i] * (inverse ? in.scale : 1 / in.scale);
  }
  product({in.batches, cameras.data(), points.data(), factors.data(), in.weights}, chunk, nullptr,
          y);
}

double square_sum(const Batches& batches, const double* cameras, const double* points,
                  const Chunk& chunk) {
  double sum = 0;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l)
      for (std::uint32_t o = 0; o < batches.groups[g].track; ++o) {
        const std::uint64_t b = batches.groups[g].first_batch + o;
        sum += row_of(batches, cameras, point_of(points, g, l), b, l).square();
      }
  return sum;
}

std::uint64_t count_behind(const Batches& batches, const double* cameras, const double* points,
                           const Chunk& chunk) {
  std::uint64_t count = 0;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l)
      for (std::uint32_t o = 0; o < batches.groups[g].track; ++o)
        count += depth(cameras, batches.image[8 * (batches.groups[g].first_batch + o) + l],
                       point_of(points, g, l)) > 0;
  return count;
}

}  // namespace

const Kernels& reference_kernels() {
  static const Kernels kernels{"reference",    false,      &linearize,  &diagonal,
                               &pairs,         &coarse,    &trial,      &product,
                               &product_float, &residuals, &square_sum, &count_behind};
  return kernels;
}

}  // namespace sheaf
