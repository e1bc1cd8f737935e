// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What a dogleg asks of rows through lenses, once more as plain scalar code.
#include <array>
#include <cmath>

#include "eliminate/reference_lens.h"

namespace sheaf {
namespace {

/// Calls visit(batch, row, its blocks, its metric) for the observations of a point.
template <class Visit>
void for_each_row(const LensProductInput& in, std::size_t g, std::uint32_t lane,
                  const Visit& visit) {
  const Batches::Group& group = in.of.batches->groups[g];
  const Vector3<double> X = point_of(in.of.at.points, g, lane);
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
    visit(lens_row(in.of, X, b, lane), BlocksOfRow(in.of, b, lane), metric_at(in.metric, b, lane));
}

/// Calls visit(group, lane) for the points of a chunk.
template <class Visit>
void for_each_point(const LensProductInput& in, const Chunk& chunk, const Visit& visit) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.of.batches->groups[g].lanes; ++l) visit(g, l);
}

/// Jc x.
std::array<double, 2> motion_of(const LensProductInput& in, const LensRow& row,
                                const BlocksOfRow& of) {
  std::array<double, 2> e{};
  for (std::size_t r = 0; r < 2; ++r)
    for (std::size_t k = 0; k < of.count; ++k)
      for (std::size_t i = 0; i < 9; ++i)
        e[r] += BlocksOfRow::row(row, k, r)[i] * in.x[kProductRecord * of.block[k] + i];
  return e;
}

}  // namespace

void lens_gradient_by_reference(const LensProductInput& in, const Chunk& chunk, double* sums) {
  for_each_point(in, chunk, [&](std::size_t g, std::uint32_t l) {
    for_each_row(in, g, l, [&](const LensRow& row, const BlocksOfRow& of, const RowMetric& m) {
      for (std::size_t k = 0; k < of.count; ++k)
        for (std::size_t r = 0; r < 2; ++r)
          for (std::size_t i = 0; i < 9; ++i)
            sums[kProductRecord * of.block[k] + i] -=
                m.w * BlocksOfRow::row(row, k, r)[i] * row.r[r];
    });
  });
}

void lens_curvature_by_reference(const LensProductInput& in, double damping, bool points_held,
                                 const Chunk& chunk, CurvatureOutput& out) {
  for_each_point(in, chunk, [&](std::size_t g, std::uint32_t l) {
    Vector3<double> gradient{}, step{};
    for_each_row(in, g, l, [&](const LensRow& row, const BlocksOfRow&, const RowMetric& m) {
      for (std::size_t r = 0; r < 2; ++r)
        for (std::size_t i = 0; i < 3; ++i) gradient[i] -= m.w * row.point[r][i] * row.r[r];
    });
    Matrix3<double> unused{};
    const Vector3<double> X = point_of(in.of.at.points, g, l);
    add_prior(*in.of.batches, g, l, X, unused, gradient);
    const double* factor = in.factors + kFactorGroup * g + l;
    for (std::size_t i = 0; i < 3 && !points_held; ++i) {
      step[i] = damping * gradient[i] / factor[factor_group::damping(static_cast<int>(i))];
      out.gradient2 += gradient[i] * step[i];
    }
    out.square_sum += prior_curvature(*in.of.batches, g, l, step);
    for_each_row(in, g, l, [&](const LensRow& row, const BlocksOfRow& of, const RowMetric& m) {
      std::array<double, 2> e = motion_of(in, row, of);
      for (std::size_t r = 0; r < 2; ++r)
        for (std::size_t i = 0; i < 3; ++i) e[r] += row.point[r][i] * step[i];
      const std::array<double, 2> between = m.times(e);
      out.square_sum += e[0] * between[0] + e[1] * between[1];
    });
  });
}

double lens_point_damping_by_reference(const LensProductInput& in, const Chunk& chunk) {
  double sum = 0;
  for_each_point(in, chunk, [&](std::size_t g, std::uint32_t l) {
    Vector3<double> s{};
    for_each_row(in, g, l, [&](const LensRow& row, const BlocksOfRow& of, const RowMetric& m) {
      add_to_point(row, m.times(motion_of(in, row, of)), s);
    });
    const double* factor = in.factors + kFactorGroup * g + l;
    const Vector3<double> d = back_substitute(factor, s);
    for (std::size_t i = 0; i < 3; ++i)
      sum += d[i] * d[i] * factor[factor_group::damping(static_cast<int>(i))];
  });
  return sum;
}

void keep_lens_rows_by_reference(const LensProductInput& in, double unit, const Chunk& chunk,
                                 float* rows) {
  const int blocks = in.of.tracks->most_blocks;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = in.of.batches->groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < 8; ++l) {
        LensRow row = lens_row(in.of, point_of(in.of.at.points, g, l), b, l);
        const RowMetric metric = metric_at(in.metric, b, l);
        row.visit_columns([&](double& j0, double& j1) {
          const std::array<double, 2> e = metric.root_times({j0, j1});
          j0 = l < group.lanes ? e[0] : 0, j1 = l < group.lanes ? e[1] : 0;
        });
        float* to = rows + 8 * kept_row::fields(blocks) * b + l;
        const auto keep = [&](double x, int field) { to[8 * field] = static_cast<float>(x); };
        for (int r = 0; r < 2; ++r) {
          const auto e = static_cast<std::size_t>(r);
          for (int i = 0; i < 3; ++i)
            keep(row.point[e][std::size_t(i)] / unit, kept_row::point(r, i));
          for (int i = 0; i < 9; ++i) keep(row.camera[e][std::size_t(i)], kept_row::camera(r, i));
          for (int k = 0; k < blocks; ++k)
            for (int i = 0; i < 9; ++i)
              keep(row.lens[std::size_t(k)][e][std::size_t(i)], kept_row::lens(k, r, i));
        }
      }
  }
}

}  // namespace sheaf
