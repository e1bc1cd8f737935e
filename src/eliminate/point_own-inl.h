// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Points under a loss: each has a Levenberg-Marquardt of its own once the cameras have stepped
// (kernels.h, inner_iterations). docs/math.md, section 12, has the algebra.
#if defined(SHEAF_ELIMINATE_POINT_OWN_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_POINT_OWN_INL_H_
#undef SHEAF_ELIMINATE_POINT_OWN_INL_H_
#else
#define SHEAF_ELIMINATE_POINT_OWN_INL_H_
#endif

#include "eliminate/point_refine-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A point's normal equations under a loss: by the weight alone, and what the metric takes from V.
struct RobustSums {
  PointSums weight;
  MetricLess less;

  HWY_INLINE void clear() {
    weight.clear();
    less.clear();
  }
  HWY_INLINE void add(const LaneJacobian& j, const Metric& m) {
    weight.add_weighted(j, m.w);
    less.add(j, m, nullptr);
  }
  /// That of the metric where it is asked for, else that of the weight.
  HWY_INLINE PointSums by(hn::Mask<D> metric) const {
    PointSums p = weight;
    less.add_to(p, hn::IfThenElseZero(metric, set(-1.0)));
    return p;
  }
  HWY_INLINE void take(hn::Mask<D> where, const RobustSums& from) {
    weight.take(where, from.weight);
    for (int i = 0; i < 6; ++i) less.v[i] = hn::IfThenElse(where, from.less.v[i], less.v[i]);
  }
};

/// As pass_part, under a loss.
template <class Source, bool kLinearize>
HWY_INLINE TrackCost robust_pass(const TrialOf<typename Source::State>& in, const GroupPart& of,
                                 const V* Y, [[maybe_unused]] const LaneChart* chart,
                                 RobustSums& sums) {
  const LossLanes loss(in.how.loss);
  const Batches& batches = *in.tried.batches;
  const bool sigmas = batches.inverse_sigma.size() > 0;
  V square = zero(), cost = zero();
  if (kLinearize) sums.clear();
  for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
    LaneJacobian j = Source::template evaluate<kLinearize>(in.tried, of, b, Y);
    V weight, r[2] = {j.r[0], j.r[1]};
    if (sigmas) {
      weight = inverse_sigma_of(batches, of, b);
      for (V& x : r) x = hn::Mul(x, weight);
    }
    const V square_here = fma(r[0], r[0], hn::Mul(r[1], r[1]));
    square = hn::Add(square, square_here);
    const Rho rho = rho_lanes(loss, square_here);
    cost = hn::Add(cost, rho.value);
    if constexpr (kLinearize) {
      if (chart != nullptr)
        for (V* row : {j.point[0], j.point[1]}) chart->transpose(row);
      const Metric metric = metric_of(rho, r, square_here);
      sums.add(j, sigmas ? weighed(metric, weight) : metric);
    }
  }
  if (batches.prior.size() > 0) {
    const PriorRows own(batches, of, Y);
    if constexpr (kLinearize) add_prior(own, chart, sums.weight);
    cost = hn::Add(cost, own.square());
  }
  return {square, cost};
}

/// The points of a part under a loss while they settle.
template <class Source, bool kCharted>
struct OwnSteps {
  const TrialOf<typename Source::State>& in;
  const GroupPart& of;
  const V* base;  ///< of the charts, where the stepped cameras have it
  LaneChart chart;
  RobustSums p;

  HWY_INLINE void place(const V* X) {
    if constexpr (kCharted) chart.place(in.how.chart, X[0], X[1], X[2], base);
  }
  template <bool kLinearize>
  HWY_INLINE TrackCost pass(const V* X, RobustSums& sums) {
    if constexpr (kLinearize) place(X);
    return robust_pass<Source, kLinearize>(in, of, X, kCharted ? &chart : nullptr, sums);
  }

  /// From where the step leads, or from `stay` where that is cheaper and the step made it worse
  /// than it was; returns where that is so.
  HWY_INLINE hn::Mask<D> begin(V mask, const V* stay, V worth, Refined& best) {
    best.at = pass<true>(best.X, p);
    const V held = load(in.how.own.held_costs + 8 * of.group + of.lane());
    const auto worse = hn::AndNot(hn::Le(best.at.cost, hn::Add(held, worth)), hn::Gt(mask, zero()));
    if (hn::AllFalse(D(), worse)) return worse;
    RobustSums unused;
    const TrackCost there = pass<false>(stay, unused);
    // What is not finite is not less.
    const auto fell = hn::AndNot(hn::Le(best.at.cost, there.cost), worse);
    if (hn::AllFalse(D(), fell)) return fell;
    for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(fell, stay[i], best.X[i]);
    best.at = pass<true>(best.X, p);
    return fell;
  }

  /// d of the damped normal equations; returns what it promises.
  HWY_INLINE V solve(hn::Mask<D> metric, V damping, V* d) const {
    const PointSums by = p.by(metric);
    V D3[3];
    const V diagonal[3] = {p.weight.v00, p.weight.v11, p.weight.v22};
    for (int i = 0; i < 3; ++i) D3[i] = fma(set(1e-12), diagonal[i], damp(damping, diagonal[i]));
    if constexpr (kCharted) D3[2] = damp_outward(in.how.chart, chart, p.weight, D3[2]);
    const Factor f = factor3(hn::Add(by.v00, D3[0]), by.v01, by.v02, hn::Add(by.v11, D3[1]), by.v12,
                             hn::Add(by.v22, D3[2]));
    V w[3];
    forward(f, by.g, w);
    backward(f, w, d);
    return fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
  }

  HWY_INLINE void follow(const V* X, V* d, V* Y) const {
    for (int i = 0; i < 3; ++i) Y[i] = hn::Add(X[i], d[i]);
    if constexpr (kCharted) {
      V step[3], to[3];
      chart.apply(d, step);
      chart.retract(in.how.chart, step, to);
      for (int i = 0; i < 3; ++i) Y[i] = hn::Add(base[i], to[i]);
    }
  }

  /// `damping`: each point's own to begin with.
  HWY_INLINE void settle(V mask, V damping, V worth, Refined& best) {
    auto active = hn::Gt(mask, zero());
    auto metric = hn::Eq(zero(), zero());
    for (int left = inner_iterations::kTries * in.how.inner_iterations; left > 0; --left) {
      V d[3], Y[3];
      // A factor that does not exist promises nothing: that point stays where it is.
      active = hn::And(active, hn::Gt(solve(metric, damping, d), worth));
      if (hn::AllFalse(D(), active)) return;
      follow(best.X, d, Y);
      RobustSums there;
      const TrackCost at = pass<true>(Y, there);
      const auto better = hn::And(active, hn::Lt(at.cost, best.at.cost));
      const auto weight_failed = hn::And(active, hn::Not(hn::Or(better, metric)));
      const auto weight_served = hn::And(better, hn::Not(metric));
      damping = hn::IfThenElse(weight_served, hn::Mul(damping, set(0.2)), damping);
      damping = hn::IfThenElse(
          weight_failed, hn::Max(hn::Mul(damping, set(10.0)), set(inner_iterations::kLeastOwn)),
          damping);
      metric = better;
      for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(better, Y[i], best.X[i]);
      best.at = {hn::IfThenElse(better, at.square, best.at.square),
                 hn::IfThenElse(better, at.cost, best.at.cost)};
      p.take(better, there);
      place(best.X);
    }
  }
};

/// Lets a part's points settle from where their step leads, or from `stay`; reads and writes their
/// own damping. Returns sum |w|^2 of those that did not follow the step.
template <class Source, bool kCharted>
HWY_INLINE V settle_points(const TrialOf<typename Source::State>& in, const GroupPart& of, V mask,
                           const V* base, const V* stay, double* own_damping, Refined& best) {
  OwnSteps<Source, kCharted> steps{in, of, base, {}, {}};
  const V worth = set(in.how.own.worth * in.how.mean_square * of.track);
  const auto fell = steps.begin(mask, stay, worth, best);
  double* const own_at = own_damping + 8 * of.group + of.lane();
  const V own = load(own_at), lambda = set(in.how.own.damping);
  const V more =
      hn::Max(set(inner_iterations::kLeastOwn), hn::Mul(set(10.0), hn::Max(lambda, own)));
  V less = hn::Mul(own, set(0.1));
  less = hn::IfThenZeroElse(hn::Lt(less, lambda), less);
  const V next = hn::IfThenElse(fell, more, less);
  store(next, own_at);
  steps.settle(mask, hn::Max(next, set(in.how.blend.inner_damping * in.how.own.damping)), worth,
               best);
  const double* pd = of.factor(in.factors);
  V left = zero();
  for (int i = 0; i < 3; ++i) {
    const V w = load(pd + factor_group::w(i));
    left = fma(w, w, left);
  }
  return hn::IfThenElseZero(fell, left);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
