// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Back-substitution and the trial cost once more as plain scalar code, of rows of any kind. `Of`
// has a trial's input `in` and what differs between kinds:
//   held(), tried()       a state: row(batch, lane, X), step(row, batch, lane), which is Jc dc,
//   images()
//                         and points()
//   count_crossed(...)    observations whose points went behind their cameras
#include <algorithm>
#include <array>
#include <cmath>

#include "eliminate/reference_point.h"

namespace sheaf {

inline Vector3<double> blended(const PointBlend& blend, const double* factor,
                               const Vector3<double>& d) {
  if (blend.plain()) return d;
  const auto at = [&](int i) { return factor[8 * i]; };
  const Vector3<double> g{at(6) / at(0), at(1) * at(6) + at(7) / at(3),
                          at(2) * at(6) + at(4) * at(7) + at(8) / at(5)};
  Vector3<double> step;
  for (int i = 0; i < 3; ++i) step[i] = blend.newton * d[i] + blend.descent * g[i] / at(9 + i);
  return step;
}

/// What a point costs where it stands, and its normal equations there: by the weight of the loss
/// alone, and what its metric takes from V.
struct PointCost {
  double square = 0, cost = 0;
  PointNormal normal;
  Matrix3<double> less{};
};

template <class Of>
PointCost cost_at(const Of& of, const Batches::Group& group, const Vector3<double>& X,
                  std::uint32_t lane) {
  PointCost out;
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    auto row = of.tried().row(b, lane, X);
    const double by = inverse_sigma_at(*of.in.batches, b, lane), square = by * by * row.square();
    const LossValue<double> rho = evaluate_loss(of.in.loss, square);
    const RowMetric metric = weighed_metric(of.in.loss, row.r, by);
    out.square += square;
    out.cost += rho.value;
    add_less(metric, row.point[0].data(), out.less);
    const double root = by * std::sqrt(rho.first);
    for (double& r : row.r) r *= root;
    row.visit_columns([root](double& j0, double& j1) { j0 *= root, j1 *= root; });
    out.normal.add(row);
  }
  const auto g = static_cast<std::size_t>(&group - of.in.batches->groups.data());
  out.cost += add_prior(*of.in.batches, g, lane, X, out.normal.V, out.normal.g);
  return out;
}

/// Inner iterations (eliminate/kernels.h) of one point from X without a loss; returns the cost
/// where it ends.
template <class Of>
PointCost refine_point(const Of& of, const Batches::Group& group, std::uint32_t lane,
                       const double* factor, const Vector3<double>& base,
                       const Vector3<double>& stay, Vector3<double>& X) {
  PointCost best = cost_at(of, group, X, lane);
  const double mean = of.in.mean_square * group.track;
  const bool charted = of.in.chart.base != ChartBase::none && of.in.inner_iterations > 0;
  if (charted && !(best.cost <= inner_iterations::kLost * mean)) {
    const PointCost there = cost_at(of, group, stay, lane);
    if (!(best.cost <= there.cost)) X = stay, best = there;
  }
  const Vector3<double> D{factor[factor_group::damping(0)], factor[factor_group::damping(1)],
                          factor[factor_group::damping(2)]};
  for (int step = 0; step < of.in.inner_iterations; ++step) {
    const PointCoordinates at(of.in.chart, base, X);
    Matrix3<double> A = best.normal.V;
    at.damp(D, of.in.blend.inner_damping, A);
    const Factor3 f = Factor3::of(A);
    const Vector3<double> w = f.forward(best.normal.g.data());
    const double decrease = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(decrease > inner_iterations::kWorthOne * mean)) break;
    const Vector3<double> Y = at.step(f.backward(w), base);
    const PointCost there = cost_at(of, group, Y, lane);
    if (!(there.cost < best.cost)) break;
    X = Y, best = there;
    if (!(decrease > inner_iterations::kWorthMore * mean)) break;
  }
  return best;
}

/// A point's own Levenberg-Marquardt under a loss (eliminate/kernels.h) from the cheaper of X and
/// `stay`; returns the cost where it ends. held: its cost before; own: its damping from step to
/// step.
template <class Of>
PointCost settle_point(const Of& of, const Batches::Group& group, std::uint32_t lane,
                       const double* factor, const Vector3<double>& base,
                       const Vector3<double>& stay, double held, double& own, Vector3<double>& X,
                       double& left_decrease) {
  using namespace inner_iterations;
  PointCost best = cost_at(of, group, X, lane);
  const double worth = of.in.own.worth * of.in.mean_square * group.track;
  const PointCost there = cost_at(of, group, stay, lane);
  const double lambda = of.in.own.damping;
  const bool fell = !(best.cost <= held + worth) && !(best.cost <= there.cost);
  own = next_own_damping(fell, lambda, own);
  if (fell) {
    X = stay, best = there;
    for (int i = 0; i < 3; ++i)
      left_decrease += factor[factor_group::w(i)] * factor[factor_group::w(i)];
  }
  double damping = std::max(own, of.in.blend.inner_damping * lambda);
  bool metric = true;
  for (int tries = kTries * of.in.inner_iterations; tries > 0; --tries) {
    const PointCoordinates at(of.in.chart, base, X);
    const Vector3<double> v = at.diagonal(best.normal.V);
    Vector3<double> D = at.damping(best.normal.V, best.normal.g, damping);
    for (std::size_t i = 0; i < 3; ++i) D[i] += 1e-12 * v[i];
    Matrix3<double> A = best.normal.V;
    for (std::size_t i = 0; i < 9 && metric; ++i) A[i] -= best.less[i];
    at.damp(D, 1, A);
    const Factor3 f = Factor3::of(A);
    const Vector3<double> w = f.forward(best.normal.g.data());
    const double decrease = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(decrease > worth)) break;
    const Vector3<double> Y = at.step(f.backward(w), base);
    const PointCost tried = cost_at(of, group, Y, lane);
    const bool better = tried.cost < best.cost;
    if (!metric) damping = better ? 0.2 * damping : std::max(10 * damping, kLeastOwn);
    if (better) X = Y, best = tried;
    metric = better;
  }
  return best;
}

/// The point's step d as back-substitution has it.
template <class Of>
Vector3<double> step_of_point(const Of& of, std::size_t g, std::uint32_t lane,
                              const Vector3<double>& X) {
  const Batches::Group& group = of.in.batches->groups[g];
  const double* metric = of.in.loss.weighs() ? of.in.metric : nullptr;
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const auto row = of.held().row(b, lane, X);
    add_to_point(row, metric_at(metric, b, lane).times(of.held().step(row, b, lane)), s);
  }
  return back_substitute(of.in.factors + kFactorGroup * g + lane, s);
}

template <class Of>
void try_point(const Of& of, std::size_t g, std::uint32_t lane, TrialOutput& out) {
  const Batches::Group& group = of.in.batches->groups[g];
  const Vector3<double> X = point_of(of.held().points(), g, lane);
  if (lane >= group.lanes) {  // stays where it is
    for (std::size_t i = 0; i < 3; ++i) out.points[kPointGroup * g + 8 * i + lane] = X[i];
    return;
  }
  const double* factor = of.in.factors + kFactorGroup * g + lane;
  const Vector3<double> d = step_of_point(of, g, lane, X);
  const auto base = [&](const double* images) {
    return base_of(of.in.chart, *of.in.batches, group, lane, images);
  };
  const PointCoordinates at(of.in.chart, base(of.held().images()), X);
  const Vector3<double> moved = base(of.tried().images()), q = at.of(d);
  Vector3<double> Y = at.step(blended(of.in.blend, factor, d), moved);
  const Vector3<double> stay =
      at.step({moved[0] - at.base[0], moved[1] - at.base[1], moved[2] - at.base[2]}, moved);
  const bool settles = of.in.loss.weighs() && of.in.inner_iterations > 0;
  const PointCost cost = settles
                             ? settle_point(of, group, lane, factor, moved, at.plain() ? X : stay,
                                            of.in.own.held_costs[8 * g + lane],
                                            out.own_damping[8 * g + lane], Y, out.left_decrease)
                             : refine_point(of, group, lane, factor, moved, stay, Y);
  double d2 = 0, x2 = 1e-300;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    out.points[kPointGroup * g + 8 * k + lane] = Y[k];
    d2 += (Y[k] - X[k]) * (Y[k] - X[k]), x2 += X[k] * X[k];
    out.damping_term += q[k] * q[k] * factor[factor_group::damping(i)];
  }
  const PointCoordinates there(of.in.chart, moved, Y);
  const double size2 = at.plain() ? d2 / x2 : chart_step2(of.in.chart, at.chart, there.chart);
  out.step2_max = std::max(out.step2_max, size2);
  out.square_sum += cost.square;
  if (of.in.loss.weighs()) out.loss_sum += cost.cost;
  out.newly_behind += of.count_crossed(group, lane, X, Y);
}

template <class Of>
void try_points(const Of& of, const Chunk& chunk, TrialOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) try_point(of, g, l, out);
}

}  // namespace sheaf
