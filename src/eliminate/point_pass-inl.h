// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The point pass: elimination of a chunk's points, and their back-substitution fused with the cost
// at the stepped state. It is one for all rows; where these come from is its Source: BalSource,
// LensSource, or rows that are kept (row_source-inl.h). A source has
//   rows(batch, mask, room)        residuals and Jacobians at the held state, of a part's lanes
//   keep(rows, o, room), stride()  where they wait until the points are factored
//   write(factor, w, rows, to)     their records
//   couple(batch, metric, s)       s += Jp^T M Jc dc
// and, where it can tell the residuals of any state (kEvaluates), evaluate(state, part, batch, Y).
#if defined(SHEAF_ELIMINATE_POINT_PASS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_POINT_PASS_INL_H_
#undef SHEAF_ELIMINATE_POINT_PASS_INL_H_
#else
#define SHEAF_ELIMINATE_POINT_PASS_INL_H_
#endif

#include <algorithm>

#include "eliminate/factor-inl.h"
#include "eliminate/group_part-inl.h"
#include "eliminate/records-inl.h"
#include "rows/metric_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A state as a source reads it, and what happens to its points.
template <class State>
struct EliminationOf {
  State of;
  PassElimination how;
};

struct EliminateSums {
  V square[kParts], loss[kParts], decrease[kParts], gradient2[kParts];
};

/// diag of what a loss's metric takes from V by its weight alone, sum (Jp^T u) (Jp^T u)^T.
struct MetricLessDiagonal {
  V v[3];

  HWY_INLINE void add(const LaneJacobian& j, const Metric& m, const LaneChart* chart) {
    V a[3];
    for (int i = 0; i < 3; ++i) a[i] = fma(m.u0, j.point[0][i], hn::Mul(m.u1, j.point[1][i]));
    if (chart != nullptr) chart->transpose(a);
    for (int i = 0; i < 3; ++i) v[i] = fma(a[i], a[i], v[i]);
  }
  /// The scaled gradient of points, squared: the largest |J_i^T r|^2 / |J_i|^2 of a column, J by
  /// the weight alone. By the metric the same gradient would count up to 1 / delta as much.
  HWY_INLINE V gradient2(const PointSums& p) const {
    const V diagonal[3] = {p.v00, p.v11, p.v22};
    V most = zero();
    for (int i = 0; i < 3; ++i) {
      const V norm2 = hn::Max(hn::Add(diagonal[i], v[i]), set(1e-300));
      most = hn::Max(most, hn::Div(hn::Mul(p.g[i], p.g[i]), norm2));
    }
    return most;
  }
};

/// What a loss's metric takes from V by its weight alone, upper triangle.
struct MetricLess {
  V v[6];

  HWY_INLINE void clear() {
    for (V& x : v) x = zero();
  }
  /// chart: of the points' coordinates; nullptr: of rows that are by them already.
  HWY_INLINE void add(const LaneJacobian& j, const Metric& m, const LaneChart* chart) {
    V a[3];
    for (int i = 0; i < 3; ++i) a[i] = fma(m.u0, j.point[0][i], hn::Mul(m.u1, j.point[1][i]));
    if (chart != nullptr) chart->transpose(a);
    for (int i = 0, at = 0; i < 3; ++i)
      for (int k = i; k < 3; ++k, ++at) v[at] = fma(a[i], a[k], v[at]);
  }
  /// p.V += sign v.
  HWY_INLINE void add_to(PointSums& p, V sign) const {
    V* const to[6] = {&p.v00, &p.v01, &p.v02, &p.v11, &p.v12, &p.v22};
    for (int i = 0; i < 6; ++i) *to[i] = fma(sign, v[i], *to[i]);
  }
};

/// The rows of a loss by the point and the image's columns.
HWY_INLINE void apply_loss(const LossRows& rows, LaneJacobian& j) {
  for (int i = 0; i < 3; ++i) rows.column(j.point[0][i], j.point[1][i]);
  for (int i = 0; i < 9; ++i) rows.column(j.camera[0][i], j.camera[1][i]);
  rows.residual(j.r);
}

/// Adds the points' own rows to their sums; chart: as for other rows.
HWY_INLINE void add_prior(const PriorRows& rows, const LaneChart* chart, PointSums& p) {
  LaneJacobian j;
  const V none = zero();
  const V of_rows[4][3] = {{rows.u[0], rows.u[1], rows.u[2]},
                           {none, rows.u[3], rows.u[4]},
                           {none, none, rows.u[5]},
                           {none, none, none}};
  for (int k = 0; k < 4; k += 2) {
    for (int r = 0; r < 2; ++r) {
      j.r[r] = k + r < 3 ? rows.r[k + r] : none;
      for (int i = 0; i < 3; ++i) j.point[r][i] = of_rows[k + r][i];
      if (chart != nullptr) chart->transpose(j.point[r]);
    }
    p.add(j);
  }
}

/// The base of a part's points at a state.
template <class Source>
HWY_INLINE void base_of(const ChartRules& rules, const typename Source::State& at,
                        const GroupPart& of, V* base) {
  load_base(rules, *at.batches, of.first_batch, of.lane(), Source::images(at), base);
}

/// Factors the points of a part, whose normal equations are p by their chart's coordinates.
template <bool kRobust, bool kCharted>
HWY_INLINE void factor_part(const PassElimination& how, const PointSums& p,
                            [[maybe_unused]] const MetricLessDiagonal& less,
                            [[maybe_unused]] const LaneChart& chart, const GroupPart& of,
                            double* factors, EliminateSums& sums, Factor& f, V* w) {
  DampedFactor damped;
  V lambda = set(how.damping);
  if (how.own_damping != nullptr)
    lambda = hn::Max(lambda, load(how.own_damping + 8 * of.group + of.lane()));
  damped.compute<kCharted>(how, lambda, p, chart);
  f = damped.f;
  forward(f, p.g, w);
  const V w2 = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
  sums.decrease[of.part] = hn::Add(sums.decrease[of.part], w2);
  V gradient2 = w2;
  if constexpr (kRobust) gradient2 = less.gradient2(p);
  sums.gradient2[of.part] = hn::Max(sums.gradient2[of.part], gradient2);
  double* out = factors + kFactorGroup * of.group + of.lane();
  Factor x = f;
  V y[3] = {w[0], w[1], w[2]};
  if constexpr (kCharted) factor_by_xyz(chart, f, w, x, y);
  const V all[factor_group::kFields] = {x.i00, x.l10, x.l20, x.i11,       x.l21,       x.i22,
                                        y[0],  y[1],  y[2],  damped.D[0], damped.D[1], damped.D[2]};
  for (int i = 0; i < factor_group::kFields; ++i) store(all[i], out + 8 * i);
}

/// The rows of batch b as the loss has them, `room` being what source.rows() left there; `weight`
/// is one over their sigma, if they have one.
template <class Source>
HWY_INLINE void weigh_rows(const EliminationOf<typename Source::State>& in, const Source& source,
                           const GroupPart& of, std::uint64_t b, const LaneChart* chart,
                           const V* weight, double* room, const EliminateOutput& out,
                           LaneJacobian& j, MetricLessDiagonal& less, V& cost) {
  const V s = fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1]));
  LossRows rows(LossLanes(in.how.loss), j.r, s);
  Metric metric = metric_of(rows.rho, j.r, s);
  if (weight != nullptr) {
    rows.weigh_columns(*weight);
    metric = weighed(metric, *weight);
  }
  less.add(j, metric, chart);
  apply_loss(rows, j);
  if constexpr (Source::kMostBlocks > 0) source.apply_loss_to_others(rows, room);
  cost = hn::Add(cost, rows.rho.value);
  store_metric(metric, out.metric + kMetricBatch * b + of.lane());
}

template <class Source, bool kRobust, bool kCharted, class GroupRecords>
HWY_INLINE void eliminate_part(const EliminationOf<typename Source::State>& in, const GroupPart& of,
                               const GroupRecords& to, const EliminateOutput& out,
                               EliminateSums& sums) {
  V X[3];
  if constexpr (Source::kEvaluates) of.load_points(Source::points(in.of), X);
  const Source source{in.of, of, X};
  const V mask = of.mask();
  const V* scale = of.full() ? nullptr : &mask;
  [[maybe_unused]] LaneChart chart;
  [[maybe_unused]] const LaneChart* const charted = kCharted ? &chart : nullptr;
  if constexpr (kCharted) {
    V base[3];
    base_of<Source>(in.how.chart, in.of, of, base);
    chart.place(in.how.chart, X[0], X[1], X[2], base);
  }
  PointSums p;
  p.clear();
  [[maybe_unused]] MetricLessDiagonal less{{zero(), zero(), zero()}};
  [[maybe_unused]] V cost = zero(), weight;
  V square = sums.square[of.part], robust = sums.loss[of.part];
  const double* rows = nullptr;
  double* const room = Source::room(to);
  // Rows that are kept have been weighed.
  [[maybe_unused]] const Batches& batches = *in.of.batches;
  const bool sigmas = kRobust && Source::kEvaluates && batches.inverse_sigma.size() > 0;
  for (std::uint32_t o = 0; o < of.track; ++o) {
    const std::uint64_t b = of.first_batch + o;
    double* const here = room + source.stride() * o;
    LaneJacobian j = source.rows(b, scale, here);
    if (sigmas) {
      weight = inverse_sigma_of(batches, of, b);
      for (V& r : j.r) r = hn::Mul(r, weight);
    }
    if constexpr (Source::kEvaluates) square = Source::add_square(j, square);
    if constexpr (kRobust)
      weigh_rows<Source>(in, source, of, b, charted, sigmas ? &weight : nullptr, here, out, j, less,
                         cost);
    if constexpr (kCharted)
      for (V* row : {j.point[0], j.point[1]}) chart.transpose(row);
    p.add(j);
    rows = source.keep(j, o, room);
  }
  sums.square[of.part] = square;
  if constexpr (kRobust && Source::kEvaluates)
    if (batches.prior.size() > 0) {
      const PriorRows own(batches, of, X);
      add_prior(own, charted, p);
      cost = hn::Add(cost, own.square());
    }
  if constexpr (kRobust) {
    store(cost, out.point_costs + 8 * of.group + of.lane());
    robust = hn::Add(robust, cost);
  }
  sums.loss[of.part] = robust;
  Factor f;
  V w[3];
  factor_part<kRobust, kCharted>(in.how, p, less, chart, of, out.factors, sums, f, w);
  source.write(f, w, rows, to);
}

template <class Source, bool kRobust, bool kCharted>
inline void eliminate_chunk(const EliminationOf<typename Source::State>& in, const Chunk& chunk,
                            const typename Source::KeptRecords& records, EliminateOutput& out) {
  EliminateSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.decrease[p] = sums.gradient2[p] = zero();
  Source::begin_chunk(in.of, records);
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    if (g + 1 < chunk.end_group) Source::prefetch(in.of, in.of.batches->groups[g + 1]);
    const auto to = Source::of_group(in.of, chunk, g, records);
    for (int p = 0; p < kParts; ++p)
      eliminate_part<Source, kRobust, kCharted>(in, {in.of.batches->groups[g], g, p}, to, out,
                                                sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (kRobust) out.loss_sum += sum_parts(sums.loss);
  out.point_decrease += sum_parts(sums.decrease);
  const double gradient2 = max_parts(sums.gradient2);
  out.gradient_max2 = gradient2 > out.gradient_max2 ? gradient2 : out.gradient_max2;
}

/// Compiled with and without a loss, and with and without charts of the points, so that a problem
/// that has none pays nothing for those that do.
template <class Source>
inline void eliminate_points(const EliminationOf<typename Source::State>& in, const Chunk& chunk,
                             const typename Source::KeptRecords& records, EliminateOutput& out) {
  const bool robust = in.how.loss.weighs();
  if (in.how.chart.base == ChartBase::none)
    (robust ? eliminate_chunk<Source, true, false>
            : eliminate_chunk<Source, false, false>)(in, chunk, records, out);
  else
    (robust ? eliminate_chunk<Source, true, true>
            : eliminate_chunk<Source, false, true>)(in, chunk, records, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
