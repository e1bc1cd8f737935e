// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Back-substitution and the trial cost once more as plain scalar code (reference.cc).
#include <algorithm>
#include <cmath>

#include "eliminate/reference_rows.h"

namespace sheaf {
namespace {

Vector3<double> blended(const PointBlend& blend, const double* factor, const Vector3<double>& d) {
  if (blend.plain()) return d;
  const auto at = [&](int i) { return factor[8 * i]; };
  const Vector3<double> g{at(6) / at(0), at(1) * at(6) + at(7) / at(3),
                          at(2) * at(6) + at(4) * at(7) + at(8) / at(5)};
  Vector3<double> step;
  for (int i = 0; i < 3; ++i) step[i] = blend.newton * d[i] + blend.descent * g[i] / at(9 + i);
  return step;
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
                       const double* factor, const Vector3<double>& base,
                       const Vector3<double>& stay, Vector3<double>& X) {
  PointCost best = cost_of(in, group, X, lane);
  const double mean = in.mean_square * group.track;
  const bool charted = in.chart.base != ChartBase::none && in.inner_iterations > 0;
  if (charted && !(best.cost <= inner_iterations::kLost * mean)) {
    const PointCost there = cost_of(in, group, stay, lane);
    if (!(best.cost <= there.cost)) X = stay, best = there;
  }
  const Vector3<double> D{factor[factor_group::damping(0)], factor[factor_group::damping(1)],
                          factor[factor_group::damping(2)]};
  for (int step = 0; step < in.inner_iterations; ++step) {
    const PointCoordinates at(in.chart, base, X);
    Matrix3<double> A = best.V;
    at.damp(D, in.blend.inner_damping, A);
    const Factor3 f = Factor3::of(A);
    const Vector3<double> w = f.forward(best.g.data());
    const double decrease = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(decrease > inner_iterations::kWorthOne * mean)) break;
    const Vector3<double> Y = at.step(f.backward(w), base);
    const PointCost there = cost_of(in, group, Y, lane);
    if (!(there.cost < best.cost)) break;
    X = Y, best = there;
    if (!(decrease > inner_iterations::kWorthMore * mean)) break;
  }
  return best;
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
  const PointCoordinates at(in.chart, base_of(in.chart, batches, group, lane, in.cameras), X);
  const Vector3<double> moved = base_of(in.chart, batches, group, lane, in.trial_cameras);
  const Vector3<double> q = at.of(d);
  Vector3<double> Y = real ? at.step(blended(in.blend, factor, d), moved) : X;
  const Vector3<double> stay =
      at.step({moved[0] - at.base[0], moved[1] - at.base[1], moved[2] - at.base[2]}, moved);
  const PointCost cost = real ? refine_point(in, group, lane, factor, moved, stay, Y) : PointCost();
  double d2 = 0, x2 = 1e-300;
  for (int i = 0; i < 3; ++i) {
    out.points[kPointGroup * g + 8 * i + lane] = Y[i];
    d2 += (Y[i] - X[i]) * (Y[i] - X[i]), x2 += X[i] * X[i];
    if (real) out.damping_term += q[i] * q[i] * factor[8 * (9 + i)];
  }
  if (!real) return;
  const PointCoordinates there(in.chart, moved, Y);
  const double size2 = at.plain() ? d2 / x2 : chart_step2(in.chart, at.chart, there.chart);
  out.step2_max = std::max(out.step2_max, size2);
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

}  // namespace

void trial_by_reference(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) trial_point(in, g, l, out);
}

}  // namespace sheaf
