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

#include "eliminate/point_own-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

struct TrialSums {
  V square[kParts], loss[kParts], damping[kParts], step2[kParts], behind[kParts], left[kParts];
};

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
                           const TrialOutput& out, TrialSums& sums) {
  V X[3], s[3] = {zero(), zero(), zero()}, d[3];
  of.load_points(Source::points(in.held), X);
  const Source source{in.held, of, X};
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b)
    source.couple(b, kRobust ? in.metric + kMetricBatch * b + of.lane() : nullptr, s);
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
    if constexpr (kRobust) {
      RobustSums unused;
      if (in.how.inner_iterations > 0)
        sums.left[of.part] =
            hn::Add(sums.left[of.part], settle_points<Source, kCharted>(in, of, mask, charted.moved,
                                                                        kCharted ? charted.stay : X,
                                                                        out.own_damping, y));
      else
        y.at = robust_pass<Source, false>(in, of, y.X, nullptr, unused);
    } else {
      PointSums unused;
      if (in.how.inner_iterations > 0)
        refine_points<Source, kCharted>(in, of, mask, charted.moved, charted.stay, y);
      else
        y.at = pass_part<Source, false>(in, of, y.X, nullptr, unused);
    }
    sums.square[of.part] = fma(y.at.square, mask, sums.square[of.part]);
    if (kRobust) sums.loss[of.part] = fma(y.at.cost, mask, sums.loss[of.part]);
  }
  of.store_points(y.X, out.points);
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
    sums.square[p] = sums.loss[p] = sums.damping[p] = sums.step2[p] = sums.behind[p] =
        sums.left[p] = zero();
  const auto& groups = in.held.batches->groups;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    if (g + 1 < chunk.end_group) Source::prefetch(in.held, groups[g + 1]);
    prefetch_groups(Source::points(in.held), in.factors, factor_group::kFields, g + 1,
                    std::min<std::size_t>(g + 2, groups.size()));
    for (int p = 0; p < kParts; ++p)
      trial_part<Source, kRobust, kCharted>(in, {groups[g], g, p}, out, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (kRobust) {
    out.loss_sum += sum_parts(sums.loss);
    out.left_decrease += sum_parts(sums.left);
  }
  out.damping_term += sum_parts(sums.damping);
  const double step2 = max_parts(sums.step2);
  out.step2_max = step2 > out.step2_max ? step2 : out.step2_max;
  out.newly_behind += static_cast<std::uint64_t>(sum_parts(sums.behind));
}

template <class Source>
inline void try_points(const TrialOf<typename Source::State>& in, const Chunk& chunk,
                       TrialOutput& out) {
  const bool robust = in.how.loss.weighs();
  if (in.how.chart.base == ChartBase::none)
    (robust ? trial_chunk<Source, true, false> : trial_chunk<Source, false, false>)(in, chunk, out);
  else
    (robust ? trial_chunk<Source, true, true> : trial_chunk<Source, false, true>)(in, chunk, out);
}

/// |r_x| and |r_y| of every lane in sigmas, masked ones included.
template <class Source>
inline void residuals_of(const typename Source::State& at, const Chunk& chunk, double* out) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) {
      const GroupPart of(at.batches->groups[g], g, p);
      V X[3];
      of.load_points(Source::points(at), X);
      for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
        LaneJacobian j = Source::template evaluate<false>(at, of, b, X);
        if (at.batches->inverse_sigma.size() > 0)
          for (V& r : j.r) r = hn::Mul(r, inverse_sigma_of(*at.batches, of, b));
        double* to = out + 16 * (b - chunk.first_batch) + of.lane();
        store(hn::Abs(j.r[0]), to), store(hn::Abs(j.r[1]), to + 8);
      }
    }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
