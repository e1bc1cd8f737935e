// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of the dogleg once more as plain scalar code, written for reading.
#include <algorithm>
#include <array>

#include "eliminate/dogleg_kernels.h"
#include "geometry/bal_camera.h"

namespace sheaf {
namespace {

/// Jacobians and residual of one observation, and the weight of its loss.
struct WeightedRow {
  BalJacobian<double> j;
  std::array<double, 2> r;
  double weight;
  const double* record;

  WeightedRow(const ProductInput& in, std::size_t g, std::uint64_t b, std::uint32_t lane) {
    const Batches& batches = *in.batches;
    record = in.cameras + kCameraRecord * batches.image[8 * b + lane];
    Matrix3<double> R;
    std::copy(record, record + 9, R.begin());
    const double* X = in.points + kPointGroup * g + lane;
    j = project_with_jacobian<double>(R, {record[9], record[10], record[11]},
                                      {record[12], record[13], record[14]}, {X[0], X[8], X[16]});
    for (int i = 0; i < 2; ++i) r[i] = j.pixel[i] - batches.xy[16 * b + 8 * i + lane];
    weight = in.weights == nullptr ? 1 : in.weights[8 * b + lane];
  }

  /// Row r of Jc dc, from the step in the camera record.
  double camera_motion(int r) const {
    const double* s = record + camera_record::kStep;
    const double f = record[12];
    const double dk1 = (s[7] - record[13] * s[6]) / f, dk2 = (s[8] - record[14] * s[6]) / f;
    const std::array<double, 9> dc{s[3], s[4], s[5], s[0], s[1], s[2], s[6], dk1, dk2};
    double e = 0;
    for (int k = 0; k < 9; ++k) e += j.camera[9 * r + k] * dc[k];
    return e;
  }
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
      for (int k = 0; k < 9; ++k) to[k] -= row.weight * row.j.camera[9 * i + k] * row.r[i];
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
    }
  for_each_observation(batches, chunk, [&](std::size_t g, std::uint64_t b, std::uint32_t l) {
    const WeightedRow row(in.state, g, b, l);
    const PointDescent point(in, g, l);
    for (int r = 0; r < 2; ++r) {
      double e = row.camera_motion(r);
      for (int k = 0; k < 3; ++k) e += row.j.point[3 * r + k] * point.step[k];
      out.square_sum += row.weight * e * e;
    }
  });
}

/// L^-T (w - L^-1 s).
Vector3<double> back_substitute(const double* factor, const Vector3<double>& s) {
  const auto at = [&](int i) { return factor[8 * i]; };
  const double u0 = s[0] * at(0), u1 = (s[1] - at(1) * u0) * at(3);
  const double u2 = (s[2] - at(2) * u0 - at(4) * u1) * at(5);
  const double v0 = at(6) - u0, v1 = at(7) - u1, v2 = at(8) - u2;
  const double d2 = v2 * at(5), d1 = (v1 - at(4) * d2) * at(3);
  return {(v0 - at(1) * d1 - at(2) * d2) * at(0), d1, d2};
}

double point_damping(const ProductInput& in, const Chunk& chunk) {
  double sum = 0;
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = in.batches->groups[g];
    for (std::uint32_t l = 0; l < group.lanes; ++l) {
      Vector3<double> s{};
      for (std::uint32_t o = 0; o < group.track; ++o) {
        const WeightedRow row(in, g, group.first_batch + o, l);
        for (int r = 0; r < 2; ++r)
          for (int k = 0; k < 3; ++k)
            s[k] += row.weight * row.j.point[3 * r + k] * row.camera_motion(r);
      }
      const double* factor = in.factors + kFactorGroup * g + l;
      const Vector3<double> d = back_substitute(factor, s);
      for (int i = 0; i < 3; ++i) sum += d[i] * d[i] * factor[8 * (9 + i)];
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
