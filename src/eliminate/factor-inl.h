// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A point's normal equations on lanes: their sums, damping and factor, and what is solved with it.
#if defined(SHEAF_ELIMINATE_FACTOR_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_FACTOR_INL_H_
#undef SHEAF_ELIMINATE_FACTOR_INL_H_
#else
#define SHEAF_ELIMINATE_FACTOR_INL_H_
#endif

#include "eliminate/kernels.h"
#include "eliminate/point_chart-inl.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Lower triangle of a 3x3 factor, diagonal inverted; W: lanes of double or of float.
template <class W>
struct FactorAs {
  W i00, l10, l20, i11, l21, i22;
};
using Factor = FactorAs<V>;

HWY_INLINE V inverse_sqrt(V x) { return hn::Div(set(1.0), hn::Sqrt(x)); }

HWY_INLINE Factor factor3(V v00, V v01, V v02, V v11, V v12, V v22) {
  Factor f;
  f.i00 = inverse_sqrt(v00);
  f.l10 = hn::Mul(v01, f.i00);
  f.l20 = hn::Mul(v02, f.i00);
  f.i11 = inverse_sqrt(fnma(f.l10, f.l10, v11));
  f.l21 = hn::Mul(fnma(f.l10, f.l20, v12), f.i11);
  f.i22 = inverse_sqrt(fnma(f.l21, f.l21, fnma(f.l20, f.l20, v22)));
  return f;
}

/// L^-1 s.
template <class W>
HWY_INLINE void forward(const FactorAs<W>& f, const W* s, W* out) {
  out[0] = hn::Mul(s[0], f.i00);
  out[1] = hn::Mul(fnma(f.l10, out[0], s[1]), f.i11);
  out[2] = hn::Mul(fnma(f.l21, out[1], fnma(f.l20, out[0], s[2])), f.i22);
}

/// Normal equations of a point: V (upper triangle) and g = -Jp^T r.
struct PointSums {
  V v00, v01, v02, v11, v12, v22;
  V g[3];

  HWY_INLINE void clear() {
    v00 = v01 = v02 = v11 = v12 = v22 = zero();
    g[0] = g[1] = g[2] = zero();
  }
  HWY_INLINE void add(const LaneJacobian& j) {
    const V *a = j.point[0], *b = j.point[1];
    v00 = fma(a[0], a[0], fma(b[0], b[0], v00));
    v01 = fma(a[0], a[1], fma(b[0], b[1], v01));
    v02 = fma(a[0], a[2], fma(b[0], b[2], v02));
    v11 = fma(a[1], a[1], fma(b[1], b[1], v11));
    v12 = fma(a[1], a[2], fma(b[1], b[2], v12));
    v22 = fma(a[2], a[2], fma(b[2], b[2], v22));
    for (int i = 0; i < 3; ++i) g[i] = fnma(a[i], j.r[0], fnma(b[i], j.r[1], g[i]));
  }
  /// Each product of rows times w.
  HWY_INLINE void add_weighted(const LaneJacobian& j, V w) {
    const V *a = j.point[0], *b = j.point[1];
    V x[3], y[3];
    for (int i = 0; i < 3; ++i) x[i] = hn::Mul(w, a[i]), y[i] = hn::Mul(w, b[i]);
    v00 = fma(x[0], a[0], fma(y[0], b[0], v00));
    v01 = fma(x[0], a[1], fma(y[0], b[1], v01));
    v02 = fma(x[0], a[2], fma(y[0], b[2], v02));
    v11 = fma(x[1], a[1], fma(y[1], b[1], v11));
    v12 = fma(x[1], a[2], fma(y[1], b[2], v12));
    v22 = fma(x[2], a[2], fma(y[2], b[2], v22));
    for (int i = 0; i < 3; ++i) g[i] = fnma(x[i], j.r[0], fnma(y[i], j.r[1], g[i]));
  }
  HWY_INLINE void take(hn::Mask<D> where, const PointSums& from) {
    const auto choose = [where](V& to, V x) { to = hn::IfThenElse(where, x, to); };
    choose(v00, from.v00), choose(v01, from.v01), choose(v02, from.v02);
    choose(v11, from.v11), choose(v12, from.v12), choose(v22, from.v22);
    for (int i = 0; i < 3; ++i) choose(g[i], from.g[i]);
  }
};

/// Marquardt's damping of the points: D = lambda diag(V), clamped.
HWY_INLINE V damp(V lambda, V v) {
  return hn::Mul(lambda, hn::Min(hn::Max(v, set(kDiagonalFloor)), set(kDiagonalCeiling)));
}

/// The factor of V + D by X, Y, Z and its w, from those by a chart's coordinates. With E = dX/dq,
///   M = L^-1 E^T = Q N,  N lower triangular:   (V + D)^-1 = E L^-T L^-1 E^T = N^T N,
/// so that N is the inverse factor by X, Y, Z and Q^T w its w. Formed by X, Y, Z themselves V would
/// lose what it knows of a far point's distance, which goes with one over its fourth power.
HWY_INLINE void factor_by_xyz(const LaneChart& chart, const Factor& f, const V* w, Factor& out,
                              V* w_out) {
  V m[3][3], rest[3] = {w[0], w[1], w[2]}, N[3][3];
  for (int k = 0; k < 3; ++k) {
    const V s[3] = {hn::Mul(chart.reach, chart.t1[k]), hn::Mul(chart.reach, chart.t2[k]),
                    hn::Mul(chart.outward, chart.n[k])};
    forward(f, s, m[k]);
  }
  V inverse[3];
  for (int i = 2; i >= 0; --i) {  // Gram and Schmidt, from the last column
    N[i][i] = hn::Sqrt(dot3(m[i], m[i]));
    inverse[i] = hn::Div(set(1.0), N[i][i]);
    for (V& x : m[i]) x = hn::Mul(x, inverse[i]);
    const auto take = [&](V* from) {
      const V along = dot3(m[i], from);
      for (int k = 0; k < 3; ++k) from[k] = fnma(m[i][k], along, from[k]);
      return along;
    };
    w_out[i] = take(rest);
    for (int k = 0; k < i; ++k) N[i][k] = take(m[k]);
  }
  out.i00 = N[0][0], out.i11 = N[1][1], out.i22 = N[2][2];
  out.l10 = hn::Neg(hn::Mul(hn::Mul(N[1][0], inverse[0]), inverse[1]));
  out.l21 = hn::Neg(hn::Mul(hn::Mul(N[2][1], inverse[1]), inverse[2]));
  out.l20 = hn::Neg(hn::Mul(fma(out.l21, N[1][0], hn::Mul(N[2][0], inverse[2])), inverse[0]));
}

/// Damping of the outward coordinate: more where rounding would pass for parallax, and where the
/// point is at its bound (ChartRules).
HWY_INLINE V damp_outward(const ChartRules& rules, const LaneChart& chart, const PointSums& p,
                          V damping) {
  const V least = hn::Mul(set(rules.rounding * rules.unit), chart.reach);
  damping = hn::Max(damping, hn::Mul(hn::Mul(least, least), hn::Add(p.v00, p.v11)));
  if (rules.crosses) return damping;
  const auto bound = hn::And(hn::Gt(chart.reach, set(kBound / rules.unit)), hn::Gt(p.g[2], zero()));
  return hn::Max(damping, hn::IfThenElseZero(bound, damp(set(kAtBound), p.v22)));
}

/// How points are eliminated; as EliminateInput says it.
struct PassElimination {
  double damping;
  bool points_held;
  ScaledLoss loss{};
  ChartRules chart{};
  const double* own_damping = nullptr;
};

/// Marquardt's damping of a part's points and the factor of V + D.
struct DampedFactor {
  Factor f;
  V D[3];

  template <bool Charted>
  HWY_INLINE void compute(const PassElimination& how, V lambda, const PointSums& p,
                          [[maybe_unused]] const LaneChart& chart) {
    D[0] = damp(lambda, p.v00), D[1] = damp(lambda, p.v11), D[2] = damp(lambda, p.v22);
    if constexpr (Charted) D[2] = damp_outward(how.chart, chart, p, D[2]);
    f = factor3(hn::Add(p.v00, D[0]), p.v01, p.v02, hn::Add(p.v11, D[1]), p.v12,
                hn::Add(p.v22, D[2]));
    if (!how.points_held) return;  // L^-1 = 0: nothing is eliminated, nothing moves
    f.i00 = f.l10 = f.l20 = f.i11 = f.l21 = f.i22 = zero();
    D[0] = D[1] = D[2] = zero();
  }
};

HWY_INLINE Factor load_factor(const double* pd) {
  const auto field = [pd](int i) { return load(pd + factor_group::factor(i)); };
  return {field(0), field(1), field(2), field(3), field(4), field(5)};
}

/// L^-T u.
template <class W>
HWY_INLINE void backward(const FactorAs<W>& f, const W* u, W* d) {
  d[2] = hn::Mul(u[2], f.i22);
  d[1] = hn::Mul(fnma(f.l21, d[2], u[1]), f.i11);
  d[0] = hn::Mul(fnma(f.l20, d[2], fnma(f.l10, d[1], u[0])), f.i00);
}

/// u = (V + D)^-1 s.
HWY_INLINE void solve_point(const double* pd, const V* s, V* u) {
  const Factor f = load_factor(pd);
  V y[3];
  forward(f, s, y);
  backward(f, y, u);
}

/// d = L^-T (w - L^-1 s); returns d^T D d.
HWY_INLINE V back_substitute(const double* pd, const V* s, V* d) {
  const Factor f = load_factor(pd);
  V u[3];
  forward(f, s, u);
  for (int i = 0; i < 3; ++i) u[i] = hn::Sub(load(pd + factor_group::w(i)), u[i]);
  backward(f, u, d);
  V sum = zero();
  for (int i = 0; i < 3; ++i)
    sum = fma(hn::Mul(d[i], d[i]), load(pd + factor_group::damping(i)), sum);
  return sum;
}

/// gradient = L w = -Jp^T r, and lambda D^-1 of it.
HWY_INLINE void descend_point(const double* pd, V lambda, V* gradient, V* step) {
  const Factor f = load_factor(pd);
  const V w0 = load(pd + factor_group::w(0)), w1 = load(pd + factor_group::w(1)),
          w2 = load(pd + factor_group::w(2));
  gradient[0] = hn::Div(w0, f.i00);
  gradient[1] = fma(f.l10, w0, hn::Div(w1, f.i11));
  gradient[2] = fma(f.l20, w0, fma(f.l21, w1, hn::Div(w2, f.i22)));
  for (int i = 0; i < 3; ++i)
    step[i] = hn::Div(hn::Mul(lambda, gradient[i]), load(pd + factor_group::damping(i)));
}

HWY_INLINE void blend_step(const PointBlend& blend, const double* pd, V* d) {
  V gradient[3], descent[3];
  descend_point(pd, set(blend.descent), gradient, descent);
  for (int i = 0; i < 3; ++i) d[i] = fma(set(blend.newton), d[i], descent[i]);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
