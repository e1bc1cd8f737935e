// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What points do once the cameras have stepped and back-substitution has moved them: without a
// loss, Gauss-Newton steps of each by itself (kernels.h, inner_iterations). Jacobians are not
// stored but computed again from the state.
#if defined(SHEAF_ELIMINATE_POINT_REFINE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_POINT_REFINE_INL_H_
#undef SHEAF_ELIMINATE_POINT_REFINE_INL_H_
#else
#define SHEAF_ELIMINATE_POINT_REFINE_INL_H_
#endif

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
  OwnIterations own{};
};
template <class State>
struct TrialOf {
  State held, tried;  ///< with the step; stepped, but for the points
  const double* factors;
  const double* metric;
  PassTrial how;
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
template <class Source, bool kLinearize>
HWY_INLINE TrackCost pass_part(const TrialOf<typename Source::State>& in, const GroupPart& of,
                               const V* Y, [[maybe_unused]] const LaneChart* chart,
                               PointSums& sums) {
  V square = zero();
  if (kLinearize) sums.clear();
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
    LaneJacobian j = Source::template evaluate<kLinearize>(in.tried, of, b, Y);
    // Summed alike: which way a lane goes depends on its neighbours, its bits must not.
    const V square_here = fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1]));
    square = hn::Add(square, square_here);
    if constexpr (kLinearize) {
      if (chart != nullptr)
        for (V* row : {j.point[0], j.point[1]}) chart->transpose(row);
      sums.add(j);
    }
  }
  return {square, square};
}

/// Points of a chart that their step has lost (kernels.h, kLost) go back to `stay`, where that
/// is better.
template <class Source>
HWY_INLINE void recover_points(const TrialOf<typename Source::State>& in, const GroupPart& of,
                               V mask, const V* base, const V* stay, LaneChart& chart, PointSums& p,
                               Refined& best) {
  const V most = set(inner_iterations::kLost * in.how.mean_square * of.track);
  const auto sound = hn::Or(hn::Eq(mask, zero()), hn::Le(best.at.cost, most));
  if (hn::AllTrue(D(), sound)) return;
  V Y[3];
  for (int i = 0; i < 3; ++i) Y[i] = hn::IfThenElse(sound, best.X[i], stay[i]);
  const TrackCost there = pass_part<Source, false>(in, of, Y, nullptr, p);
  // Not finite is not less.
  const auto keep = hn::Or(sound, hn::Le(best.at.cost, there.cost));
  for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(keep, best.X[i], Y[i]);
  chart.place(in.how.chart, best.X[0], best.X[1], best.X[2], base);
  best.at = pass_part<Source, true>(in, of, best.X, &chart, p);
}

/// Gauss-Newton steps of each point by itself with the stepped cameras held, as long as they are
/// worth a pass and lower that point's own cost (kernels.h, inner_iterations). base: of the
/// charts, where the stepped cameras have it; stay: the points, had they only followed it.
template <class Source, bool kCharted>
HWY_INLINE void refine_points(const TrialOf<typename Source::State>& in, const GroupPart& of,
                              V mask, [[maybe_unused]] const V* base,
                              [[maybe_unused]] const V* stay, Refined& best) {
  const PassTrial& how = in.how;
  const double* pd = of.factor(in.factors);
  LaneChart chart;
  const LaneChart* const used = kCharted ? &chart : nullptr;
  if constexpr (kCharted) chart.place(how.chart, best.X[0], best.X[1], best.X[2], base);
  PointSums p;
  best.at = pass_part<Source, true>(in, of, best.X, used, p);
  auto active = hn::Gt(mask, zero());
  if constexpr (kCharted) recover_points<Source>(in, of, mask, base, stay, chart, p, best);
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
    const TrackCost at = steps_left > 0 ? pass_part<Source, true>(in, of, Y, used, p)
                                        : pass_part<Source, false>(in, of, Y, used, p);
    active = hn::And(active, hn::Lt(at.cost, best.at.cost));
    for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(active, Y[i], best.X[i]);
    best.at = {hn::IfThenElse(active, at.square, best.at.square),
               hn::IfThenElse(active, at.cost, best.at.cost)};
    active = hn::And(active, far);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
