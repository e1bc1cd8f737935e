// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels once more as plain scalar code, one observation at a time: what the fast ones are
// tested against. Written for reading, not for speed.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "eliminate/kernel_table.h"
#include "eliminate/reference_rows.h"

namespace sheaf {
namespace {

void store_factor(const Factor3& f, const Vector3<double>& w, const Vector3<double>& D,
                  double* out) {
  std::array<double, factor_group::kFields> all{
      1 / f.l00, f.l10, f.l20, 1 / f.l11, f.l21, 1 / f.l22, w[0], w[1], w[2], D[0], D[1], D[2]};
  if (f.held) all.fill(0);
  for (int i = 0; i < factor_group::kFields; ++i) out[8 * i] = all[i];
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
    c_entry(T, C, 0, k) = c0;
    c_entry(T, C, 1, k) = c1;
    for (int i = 0; i < 3; ++i) T[t_record::at(i, k)] = Jc[k] * B0[i] + Jc[9 + k] * B1[i];
  }
  double* h = T + t_record::kH;
  T[t_record::kRow8 + 3] = 0;
  h[0] = q[0] / l00;
  h[1] = (q[1] - l10 * h[0]) / l11;
}

void eliminate_point(const EliminateInput& in, const Chunk& chunk, std::size_t g,
                     std::uint32_t lane, double* T, double* C, EliminateOutput& out) {
  const Batches::Group& group = in.batches->groups[g];
  const Vector3<double> X = point_of(in.points, g, lane);
  std::array<double, 9> A{}, less{};
  Vector3<double> gradient{};
  double cost = 0;
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    Row row = row_of(*in.batches, in.cameras, X, b, lane);
    const double by = inverse_sigma_at(*in.batches, b, lane);
    out.square_sum += by * by * row.square();
    if (in.loss.weighs()) {
      const RowMetric metric = weighed_metric(in.loss, row.r, by);
      add_less(metric, row.j.point.data(), less);
      cost += apply_loss(in.loss, row, by).value;
      store_metric(metric, out.metric, b, lane);
    }
    for (int e = 0; e < 2; ++e)
      for (int i = 0; i < 3; ++i) {
        gradient[i] -= row.j.point[3 * e + i] * row.r[e];
        for (int k = 0; k < 3; ++k) A[3 * i + k] += row.j.point[3 * e + i] * row.j.point[3 * e + k];
      }
  }
  cost += add_prior(*in.batches, g, lane, X, A, gradient);
  out.loss_sum += cost;
  const PointCoordinates at(in.chart, base_of(in.chart, *in.batches, group, lane, in.cameras), X);
  const double lambda = damping_of_point(in.damping, in.own_damping, g, lane);
  const double by_weight = gradient_by_weight(at, A, less, gradient);
  const Vector3<double> D = at.damping(A, gradient, lambda);
  at.damp(D, 1, A);
  Factor3 f = Factor3::of(A);
  f.held = in.points_held;
  const Vector3<double> w = f.forward(gradient.data());
  const double w2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
  out.point_decrease += w2;
  out.gradient_max2 = std::max(out.gradient_max2, in.loss.weighs() ? by_weight : w2);
  if (in.loss.weighs()) out.point_costs[8 * g + lane] = cost;
  store_factor(f, w, D, out.factors + kFactorGroup * g + lane);
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    const std::uint64_t record = 8 * (b - chunk.first_batch) + lane;
    Row row = row_of(*in.batches, in.cameras, X, b, lane);
    if (in.loss.weighs()) apply_loss(in.loss, row, inverse_sigma_at(*in.batches, b, lane));
    write_record(row, f, w, T + kTRecord * record, C + kCRecord * record);
  }
}

void add_diagonal(const double* T, const double* C, double* to) {
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k < 9; ++k) {
      const double s =
          c_entry(T, C, 0, i) * c_entry(T, C, 0, k) + c_entry(T, C, 1, i) * c_entry(T, C, 1, k);
      if (k < 8 || i == 8) to[diagonal_layout::at(i, k)] += s;
    }
    double squares = 0;
    for (int c = 0; c < 3; ++c) squares += T[t_record::at(c, i)] * T[t_record::at(c, i)];
    const double* h = T + t_record::kH;
    const double rhs = c_entry(T, C, 0, i) * h[0] + c_entry(T, C, 1, i) * h[1];
    to[diagonal_layout::right_side(i)] += rhs;
    to[diagonal_layout::squares(i)] += squares;
  }
}

void add_pair(const double* Ta, const double* Tb, double* tile) {
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 9; ++k) {
      double s = 0;
      for (int c = 0; c < 3; ++c) s += Ta[t_record::at(c, i)] * Tb[t_record::at(c, k)];
      tile[tile_layout::at(i, k)] += s;
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

/// Every ordered pair of records of a point, as it stands in the text.
void coarse(const Batches& batches, const Chunk& chunk, const Records& records,
            const CoarseInput& in, double*, double* sums) {
  const auto projected = [&](std::size_t record, std::uint32_t image, int q, int m) {
    double sum = 0;
    for (int r = 0; r < 7; ++r)
      sum += records.T[kTRecord * record + t_record::at(q, r)] *
             in.basis[kCoarseBasis * image + 8 * r + m];
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
    add_to_point(row, metric_at(in.metric, b, lane).times(e), s);
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
    e = metric_at(in.metric, b, lane).times(e);
    std::array<double, 9> v{};
    for (int r = 0; r < 2; ++r)
      for (int k = 0; k < 9; ++k) v[k] += row.j.camera[9 * r + k] * e[r];
    const double* lens = record + camera_record::kFocal;
    v[7] /= lens[0], v[8] /= lens[0];  // to the sums s n, s n^2, and s from y_f
    v[6] -= lens[1] * v[7] + lens[2] * v[8];
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
          out[16 * (b - chunk.first_batch) + 8 * e + l] =
              inverse_sigma_at(batches, b, l) * std::abs(row.r[e]);
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
  product({in.batches, cameras.data(), points.data(), factors.data(), in.metric}, chunk, nullptr,
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
  static const Kernels kernels{"reference",    false,      &linearize,          &diagonal,
                               &pairs,         &coarse,    &trial_by_reference, &product,
                               &product_float, &residuals, &square_sum,         &count_behind};
  return kernels;
}

}  // namespace sheaf
