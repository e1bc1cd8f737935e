// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Charts of points on lanes; geometry/point_chart.h is the scalar statement of the same formulas.
#if defined(SHEAF_LINEAR_POINT_CHART_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_POINT_CHART_INL_H_
#undef SHEAF_LINEAR_POINT_CHART_INL_H_
#else
#define SHEAF_LINEAR_POINT_CHART_INL_H_
#endif

#include "geometry/point_chart.h"
#include "lists/batches.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

HWY_INLINE V dot3(const V* a, const V* b) {
  return fma(a[0], b[0], fma(a[1], b[1], hn::Mul(a[2], b[2])));
}

/// The base of a part's points: an origin, or the centre C = -R^T t of the first camera of each.
HWY_INLINE void load_base(const ChartRules& rules, const Batches& batches, std::uint64_t batch,
                          int lane, const double* cameras, V* base) {
  if (rules.base == ChartBase::origin) {
    for (int k = 0; k < 3; ++k) base[k] = set(rules.origin[k]);
    return;
  }
  V c[8 * camera_record::kStateOctets];
  load_cameras<camera_record::kStateOctets>(cameras, &batches.image[8 * batch + lane],
                                            batches.uniform[batch], c);
  const V* t = c + camera_record::kTranslation;
  for (int k = 0; k < 3; ++k)
    base[k] = hn::Neg(fma(c[k], t[0], fma(c[3 + k], t[1], hn::Mul(c[6 + k], t[2]))));
}

/// PointChart of a point in each lane.
struct LaneChart {
  V Y[3], t1[3], t2[3], n[3];
  V reach2, reach, outward;

  /// At X, about a base.
  HWY_INLINE void place(const ChartRules& rules, V X0, V X1, V X2, const V* base) {
    Y[0] = hn::Sub(X0, base[0]), Y[1] = hn::Sub(X1, base[1]), Y[2] = hn::Sub(X2, base[2]);
    const V r2 = dot3(Y, Y);
    const double soft2 = rules.base == ChartBase::origin ? 1 / (rules.unit * rules.unit) : 0;
    reach2 = hn::Add(r2, set(soft2));
    const V r = hn::Sqrt(r2), one = set(1.0);
    reach = soft2 == 0 ? r : hn::Sqrt(reach2);
    outward = hn::Mul(set(rules.unit), reach2);
    const auto away = hn::Gt(r, set(1e-150));
    const V inverse = hn::IfThenElseZero(away, hn::Div(one, r));
    for (int i = 0; i < 3; ++i) n[i] = hn::Mul(Y[i], inverse);
    n[2] = hn::IfThenElse(away, n[2], one);
    const V sign = hn::IfThenElse(hn::Lt(n[2], zero()), set(-1.0), one);
    const V a = hn::Div(set(-1.0), hn::Add(sign, n[2])), b = hn::Mul(hn::Mul(n[0], n[1]), a);
    t1[0] = fma(hn::Mul(sign, n[0]), hn::Mul(n[0], a), one);
    t1[1] = hn::Mul(sign, b);
    t1[2] = hn::Neg(hn::Mul(sign, n[0]));
    t2[0] = b;
    t2[1] = fma(hn::Mul(n[1], n[1]), a, sign);
    t2[2] = hn::Neg(n[1]);
  }

  /// (dX/dq)^T g, in place.
  HWY_INLINE void transpose(V* g) const {
    const V a = hn::Mul(reach, dot3(t1, g)), b = hn::Mul(reach, dot3(t2, g));
    const V c = hn::Mul(outward, dot3(n, g));
    g[0] = a, g[1] = b, g[2] = c;
  }
  /// dX/dq q.
  HWY_INLINE void apply(const V* q, V* d) const {
    const V a = hn::Mul(reach, q[0]), b = hn::Mul(reach, q[1]), c = hn::Mul(outward, q[2]);
    for (int i = 0; i < 3; ++i) d[i] = fma(t1[i], a, fma(t2[i], b, hn::Mul(n[i], c)));
  }
  /// q with dX/dq q = d.
  HWY_INLINE void coordinates(const V* d, V* q) const {
    const V inverse = hn::Div(set(1.0), reach);
    q[0] = hn::Mul(dot3(t1, d), inverse);
    q[1] = hn::Mul(dot3(t2, d), inverse);
    q[2] = hn::Div(dot3(n, d), outward);
  }
  /// Where the point ends after the step d of X - base, from the base.
  HWY_INLINE void retract(const ChartRules& rules, const V* d, V* out) const {
    const V far = hn::Div(dot3(d, Y), reach2);
    const V least = hn::Mul(set(rules.unit / kFarthest), reach);
    const V left = hn::Sub(set(1.0), far);
    V kept = hn::Max(left, least);
    if (rules.crosses)
      kept = hn::IfThenElse(hn::Lt(left, zero()), hn::Min(left, hn::Neg(least)), kept);
    const V stretch = hn::Div(set(1.0), kept);
    for (int i = 0; i < 3; ++i) out[i] = hn::Mul(hn::Add(Y[i], fnma(far, Y[i], d[i])), stretch);
  }
};

/// chart_step2 of the points before and after, which end at Y from their bases.
HWY_INLINE V chart_step2_lanes(const ChartRules& rules, const LaneChart& before, const V* Y) {
  const double s = 1 / rules.unit, soft2 = rules.base == ChartBase::origin ? s * s : 0;
  const V reach = hn::Sqrt(hn::Add(dot3(Y, Y), set(soft2)));
  const V u_scale = hn::Div(set(1.0), before.reach), v_scale = hn::Div(set(1.0), reach);
  V same = zero(), minus = zero(), plus = zero();
  for (int i = 0; i < 4; ++i) {
    const V u = hn::Mul(i < 3 ? before.Y[i] : set(s), u_scale);
    const V v = hn::Mul(i < 3 ? Y[i] : set(s), v_scale);
    const V less = hn::Sub(u, v), more = hn::Add(u, v);
    same = fma(u, v, same);
    minus = fma(less, less, minus);
    plus = fma(more, more, plus);
  }
  return hn::IfThenElse(hn::Lt(same, zero()), plus, minus);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
