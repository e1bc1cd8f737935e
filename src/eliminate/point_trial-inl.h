// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The second half of the point pass (point_pass-inl.h): points follow the cameras' step by
// back-substitution, are refined one by one, and the cost is read where they end. Jacobians are not
// stored but computed again from the state.
#if defined(SHEAF_ELIMINATE_POINT_TRIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_POINT_TRIAL_INL_H_
#undef SHEAF_ELIMINATE_POINT_TRIAL_INL_H_
#else
#define SHEAF_ELIMINATE_POINT_TRIAL_INL_H_
#endif

#include <algorithm>

#include "eliminate/point_pass-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// How points follow a step of the cameras; as TrialInput says it.
struct PassTrial {
  bool watch_behind;
  int inner_iterations;
  double mean_square;
  ScaledLoss loss{};
  ChartRules chart{};
  PointBlend blend{};
};
template <class State>
struct TrialOf {
  State held, tried;  ///< with the step; stepped, but for the points
  const double* factors;
  const double* weights;
  PassTrial how;
};

struct TrialSums {
  V square[kParts], loss[kParts], damping[kParts], step2[kParts], behind[kParts];
};

/// Sum |r|^2 of a track, and sum rho(|r|^2): the same without a loss.
struct TrackCost {
  V square, cost;
};

/// The points of a part while they are refined: the best place so far and what it costs.
struct Refined {
  V X[3];
  TrackCost at;
};

/// One pass over a part's observations at points Y: their cost and, if asked for, the points' sums.
/// chart: of the points' sums; nullptr: by X, Y, Z.
template <class Source, bool kRobust, bool kLinearize>
HWY_INLINE TrackCost pass_part(const TrialOf<typename Source::State>& in, const GroupPart& of,
                               const V* Y, [[maybe_unused]] const LaneChart* chart,
                               PointSums& sums) {
  V square = zero(), cost = zero();
  if (kLinearize) sums.clear();
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
    LaneJacobian j = Source::template evaluate<kLinearize>(in.tried, of, b, Y);
    // Summed alike: which way a lane goes depends on its neighbours, its bits must not.
    const V square_here = fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1]));
    square = hn::Add(square, square_here);
    if constexpr (kRobust) {
      const Rho rho = rho_lanes(LossLanes(in.how.loss), square_here);
      cost = hn::Add(cost, rho.value);
      if constexpr (kLinearize) scale_point_rows(hn::Sqrt(rho.weight), j);
    }
    if constexpr (kLinearize) {
      if (chart != nullptr)
        for (V* row : {j.point[0], j.point[1]}) chart->transpose(row);
      sums.add(j);
    }
  }
  return {square, kRobust ? cost : square};
}

/// Points of a chart that their step has lost (kernels.h, kLost) go back to `stay`, where that
/// is better.
template <class Source, bool kRobust>
HWY_INLINE void recover_points(const TrialOf<typename Source::State>& in, const GroupPart& of,
                               V mask, const V* base, const V* stay, LaneChart& chart, PointSums& p,
                               Refined& best) {
  const V most = set(inner_iterations::kLost * in.how.mean_square * of.track);
  const auto sound = hn::Or(hn::Eq(mask, zero()), hn::Le(best.at.cost, most));
  if (hn::AllTrue(D(), sound)) return;
  V Y[3];
  for (int i = 0; i < 3; ++i) Y[i] = hn::IfThenElse(sound, best.X[i], stay[i]);
  const TrackCost there = pass_part<Source, kRobust, false>(in, of, Y, nullptr, p);
  // Not finite is not less.
  const auto keep = hn::Or(sound, hn::Le(best.at.cost, there.cost));
  for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(keep, best.X[i], Y[i]);
  chart.place(in.how.chart, best.X[0], best.X[1], best.X[2], base);
  best.at = pass_part<Source, kRobust, true>(in, of, best.X, &chart, p);
}

/// Gauss-Newton steps of each point by itself with the stepped cameras held, as long as they are
/// worth a pass and lower that point's own cost (kernels.h, inner_iterations). base: of the
/// charts, where the stepped cameras have it; stay: the points, had they only followed it.
template <class Source, bool kRobust, bool kCharted>
HWY_INLINE void refine_points(const TrialOf<typename Source::State>& in, const GroupPart& of,
                              V mask, [[maybe_unused]] const V* base,
                              [[maybe_unused]] const V* stay, Refined& best) {
  const PassTrial& how = in.how;
  const double* pd = of.factor(in.factors);
  LaneChart chart;
  const LaneChart* const used = kCharted ? &chart : nullptr;
  if constexpr (kCharted) chart.place(how.chart, best.X[0], best.X[1], best.X[2], base);
  PointSums p;
  best.at = pass_part<Source, kRobust, true>(in, of, best.X, used, p);
  auto active = hn::Gt(mask, zero());
  if constexpr (kCharted) recover_points<Source, kRobust>(in, of, mask, base, stay, chart, p, best);
  const double mean = how.mean_square * of.track;
  const V worth_one = set(inner_iterations::kWorthOne * mean);
  const V worth_more = set(inner_iterations::kWorthMore * mean);
  const V weak = set(how.blend.inner_damping);
  for (int steps_left = how.inner_iterations; steps_left > 0;) {
    const auto damped = [&](int i, V v) {
      return fma(weak, load(pd + factor_group::damping(i)), v);
    };
    const Factor f =
        factor3(damped(0, p.v00), p.v01, p.v02, damped(1, p.v11), p.v12, damped(2, p.v22));
    V w[3], d[3];
    forward(f, p.g, w);
    backward(f, w, d);
    const V decrease = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
    active = hn::And(active, hn::Gt(decrease, worth_one));
    if (hn::AllFalse(D(), active)) return;
    const auto far = hn::And(active, hn::Gt(decrease, worth_more));
    steps_left = hn::AllFalse(D(), far) ? 0 : steps_left - 1;
    V Y[3];
    for (int i = 0; i < 3; ++i) Y[i] = hn::Add(best.X[i], d[i]);
    if constexpr (kCharted) {
      V step[3], to[3];
      chart.apply(d, step);
      chart.retract(how.chart, step, to);
      for (int i = 0; i < 3; ++i) Y[i] = hn::Add(base[i], to[i]);
      chart.place(how.chart, Y[0], Y[1], Y[2], base);
    }
    const TrackCost at = steps_left > 0 ? pass_part<Source, kRobust, true>(in, of, Y, used, p)
                                        : pass_part<Source, kRobust, false>(in, of, Y, used, p);
    active = hn::And(active, hn::Lt(at.cost, best.at.cost));
    for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(active, Y[i], best.X[i]);
    best.at = {hn::IfThenElse(active, at.square, best.at.square),
               hn::IfThenElse(active, at.cost, best.at.cost)};
    active = hn::And(active, far);
  }
}

/// Observations whose points were before their cameras and, at Y, are behind them.
template <class Source>
HWY_INLINE V count_crossed(const TrialOf<typename Source::State>& in, const GroupPart& of,
                           const V* X, const V* Y) {
  V behind = zero();
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
    const auto crossed = hn::And(hn::Gt(Source::depth(in.tried, of, b, Y), zero()),
                                 hn::Le(Source::depth(in.held, of, b, X), zero()));
    behind = hn::Add(behind, hn::IfThenElseZero(crossed, set(1.0)));
  }
  return behind;
}

/// The step of a part's points in their charts.
template <class Source>
struct ChartedStep {
  V base[3], moved[3];  ///< of the charts, before and after the cameras stepped
  V stay[3];            ///< the points, had they only followed it
  LaneChart from;

  /// d: by X, Y, Z. Returns q^T D q of its coordinates q.
  HWY_INLINE V take(const TrialOf<typename Source::State>& in, const GroupPart& of, V mask,
                    const V* X, const V* d, Refined& y) {
    const ChartRules& rules = in.how.chart;
    const double* pd = of.factor(in.factors);
    base_of<Source>(rules, in.held, of, base);
    base_of<Source>(rules, in.tried, of, moved);
    from.place(rules, X[0], X[1], X[2], base);
    V q[3], e[3], to[3], damping = zero();
    from.coordinates(d, q);
    for (int i = 0; i < 3; ++i) {
      damping = fma(hn::Mul(q[i], q[i]), load(pd + factor_group::damping(i)), damping);
      e[i] = hn::Sub(d[i], hn::Sub(moved[i], base[i]));
      stay[i] = hn::Add(moved[i], from.Y[i]);
    }
    from.retract(rules, e, to);
    const auto real = hn::Gt(mask, zero());
    for (int i = 0; i < 3; ++i) y.X[i] = hn::IfThenElse(real, hn::Add(moved[i], to[i]), X[i]);
    return damping;
  }

  /// Size of the step to y, refined or not.
  HWY_INLINE V size2(const ChartRules& rules, V mask, const Refined& y) const {
    V Y[3];
    for (int i = 0; i < 3; ++i) Y[i] = hn::Sub(y.X[i], moved[i]);
    return hn::IfThenElseZero(hn::Gt(mask, zero()), chart_step2_lanes(rules, from, Y));
  }
};

/// |Y - X|^2 / |X|^2.
HWY_INLINE V relative_step2(const V* X, const V* Y) {
  const V d0 = hn::Sub(Y[0], X[0]), d1 = hn::Sub(Y[1], X[1]), d2 = hn::Sub(Y[2], X[2]);
  const V moved = fma(d0, d0, fma(d1, d1, hn::Mul(d2, d2)));
  return hn::Div(moved, fma(X[0], X[0], fma(X[1], X[1], fma(X[2], X[2], set(1e-300)))));
}

template <class Source, bool kRobust, bool kCharted>
HWY_INLINE void trial_part(const TrialOf<typename Source::State>& in, const GroupPart& of,
                           double* stepped, TrialSums& sums) {
  V X[3], s[3] = {zero(), zero(), zero()}, d[3];
  of.load_points(Source::points(in.held), X);
  const Source source{in.held, of, X};
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b)
    source.couple(b, kRobust ? in.weights + 8 * b + of.lane() : nullptr, s);
  const V mask = of.mask();
  if (!of.full())  // masked lanes stay where they are
    for (V& x : s) x = hn::Mul(x, mask);
  const double* pd = of.factor(in.factors);
  V damping = back_substitute(pd, s, d);
  if (!in.how.blend.plain()) blend_step(in.how.blend, pd, d);
  Refined y{{hn::Add(X[0], d[0]), hn::Add(X[1], d[1]), hn::Add(X[2], d[2])}, {zero(), zero()}};
  [[maybe_unused]] ChartedStep<Source> charted;
  if constexpr (kCharted) damping = charted.take(in, of, mask, X, d, y);
  if constexpr (Source::kEvaluates) {
    PointSums unused;
    if (in.how.inner_iterations > 0)
      refine_points<Source, kRobust, kCharted>(in, of, mask, charted.moved, charted.stay, y);
    else
      y.at = pass_part<Source, kRobust, false>(in, of, y.X, nullptr, unused);
    sums.square[of.part] = fma(y.at.square, mask, sums.square[of.part]);
    if (kRobust) sums.loss[of.part] = fma(y.at.cost, mask, sums.loss[of.part]);
  }
  of.store_points(y.X, stepped);
  sums.damping[of.part] = fma(damping, mask, sums.damping[of.part]);
  V step2;
  if constexpr (kCharted)
    step2 = charted.size2(in.how.chart, mask, y);
  else
    step2 = relative_step2(X, y.X);
  sums.step2[of.part] = hn::Max(sums.step2[of.part], step2);
  if constexpr (Source::kCountsBehind)
    if (in.how.watch_behind)
      sums.behind[of.part] = fma(count_crossed<Source>(in, of, X, y.X), mask, sums.behind[of.part]);
}

template <class Source, bool kRobust, bool kCharted>
inline void trial_chunk(const TrialOf<typename Source::State>& in, const Chunk& chunk,
                        TrialOutput& out) {
  TrialSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.damping[p] = sums.step2[p] = sums.behind[p] = zero();
  const auto& groups = in.held.batches->groups;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    if (g + 1 < chunk.end_group) Source::prefetch(in.held, groups[g + 1]);
    prefetch_groups(Source::points(in.held), in.factors, factor_group::kFields, g + 1,
                    std::min<std::size_t>(g + 2, groups.size()));
    for (int p = 0; p < kParts; ++p)
      trial_part<Source, kRobust, kCharted>(in, {groups[g], g, p}, out.points, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (kRobust) out.loss_sum += sum_parts(sums.loss);
  out.damping_term += sum_parts(sums.damping);
  const double step2 = max_parts(sums.step2);
  out.step2_max = step2 > out.step2_max ? step2 : out.step2_max;
  out.newly_behind += static_cast<std::uint64_t>(sum_parts(sums.behind));
}

template <class Source>
inline void try_points(const TrialOf<typename Source::State>& in, const Chunk& chunk,
                       TrialOutput& out) {
  const bool robust = in.how.loss.kind != LossKind::none;
  if (in.how.chart.base == ChartBase::none)
    (robust ? trial_chunk<Source, true, false> : trial_chunk<Source, false, false>)(in, chunk, out);
  else
    (robust ? trial_chunk<Source, true, true> : trial_chunk<Source, false, true>)(in, chunk, out);
}

/// |r_x| and |r_y| of every lane, masked ones included.
template <class Source>
inline void residuals_of(const typename Source::State& at, const Chunk& chunk, double* out) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) {
      const GroupPart of(at.batches->groups[g], g, p);
      V X[3];
      of.load_points(Source::points(at), X);
      for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
        const LaneJacobian j = Source::template evaluate<false>(at, of, b, X);
        double* to = out + 16 * (b - chunk.first_batch) + of.lane();
        store(hn::Abs(j.r[0]), to), store(hn::Abs(j.r[1]), to + 8);
      }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
