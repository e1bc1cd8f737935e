// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of the dogleg once more as plain scalar code, written for reading.
#include <algorithm>
#include <array>

#include "eliminate/dogleg_kernels.h"
#include "eliminate/reference_rows.h"

namespace sheaf {
namespace {

/// One observation, and the metric of its loss.
struct WeightedRow {
  Row row;
  RowMetric metric;
  const double* record;

  WeightedRow(const ProductInput& in, std::size_t g, std::uint64_t b, std::uint32_t lane)
      : row(row_of(*in.batches, in.cameras, point_of(in.points, g, lane), b, lane)),
        metric(metric_at(in.metric, b, lane)),
        record(in.cameras + kCameraRecord * in.batches->image[8 * b + lane]) {}
};

template <class Visit>
void for_each_observation(const Batches& batches, const Chunk& chunk, const Visit& visit) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l)
      for (std::uint32_t o = 0; o < batches.groups[g].track; ++o)
        visit(g, batches.groups[g].first_batch + o, l);
}

void gradient(const ProductInput& in, const Chunk& chunk, double* sums) {
  for_each_observation(*in.batches, chunk, [&](std::size_t g, std::uint64_t b, std::uint32_t l) {
    const WeightedRow row(in, g, b, l);
    double* to = sums + kProductRecord * in.batches->image[8 * b + l];
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 9; ++k)
        to[k] -= row.metric.w * row.row.j.camera[9 * i + k] * row.row.r[i];
  });
}

/// g = L w, and C^-1 g with C = D / lambda.
struct PointDescent {
  Vector3<double> gradient{}, step{};

  PointDescent(const CurvatureInput& in, std::size_t g, std::uint32_t lane) {
    if (in.points_held) return;
    const double* factor = in.state.factors + kFactorGroup * g + lane;
    const auto at = [&](int i) { return factor[8 * i]; };
    gradient = {at(6) / at(0), at(1) * at(6) + at(7) / at(3),
                at(2) * at(6) + at(4) * at(7) + at(8) / at(5)};
    for (int i = 0; i < 3; ++i) step[i] = in.damping * gradient[i] / at(9 + i);
  }
};

void curvature(const CurvatureInput& in, const Chunk& chunk, CurvatureOutput& out) {
  const Batches& batches = *in.state.batches;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l) {
      const PointDescent point(in, g, l);
      for (int i = 0; i < 3; ++i) out.gradient2 += point.gradient[i] * point.step[i];
      out.square_sum += prior_curvature(batches, g, l, point.step);
    }
  for_each_observation(batches, chunk, [&](std::size_t g, std::uint64_t b, std::uint32_t l) {
    const WeightedRow row(in.state, g, b, l);
    const PointDescent point(in, g, l);
    auto e = camera_motion(row.row, row.record);
    for (int r = 0; r < 2; ++r)
      for (int k = 0; k < 3; ++k) e[r] += row.row.j.point[3 * r + k] * point.step[k];
    const auto m = row.metric.times(e);
    out.square_sum += e[0] * m[0] + e[1] * m[1];
  });
}

double point_damping(const ProductInput& in, const Chunk& chunk) {
  double sum = 0;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = in.batches->groups[g];
    for (std::uint32_t l = 0; l < group.lanes; ++l) {
      Vector3<double> s{};
      for (std::uint32_t o = 0; o < group.track; ++o) {
        const WeightedRow row(in, g, group.first_batch + o, l);
        add_to_point(row.row, row.metric.times(camera_motion(row.row, row.record)), s);
      }
      const double* factor = in.factors + kFactorGroup * g + l;
      const Vector3<double> d = back_substitute(factor, s);
      for (int i = 0; i < 3; ++i) sum += d[i] * d[i] * factor[factor_group::damping(i)];
    }
  }
  return sum;
}

}  // namespace

const DoglegKernels& reference_dogleg_kernels() {
  static const DoglegKernels kernels{"reference", &gradient, &curvature, &point_damping};
  return kernels;
}

}  // namespace sheaf
