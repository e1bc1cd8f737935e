// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What a loss makes of an observation's rows, on lanes; geometry/row_metric.h is the scalar
// statement of the same formulas.
#if defined(SHEAF_ROWS_METRIC_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ROWS_METRIC_LANES_INL_H_
#undef SHEAF_ROWS_METRIC_LANES_INL_H_
#else
#define SHEAF_ROWS_METRIC_LANES_INL_H_
#endif

#include "lists/block_layout.h"
#include "rows/loss_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// M = w I - u u^T of one observation per lane; W: lanes of double or of float.
template <class W>
struct MetricAs {
  W w, u0, u1;

  /// e <- M e.
  HWY_INLINE void apply(W& e0, W& e1) const {
    const W along = fma(u0, e0, hn::Mul(u1, e1));
    e0 = fnma(u0, along, hn::Mul(w, e0));
    e1 = fnma(u1, along, hn::Mul(w, e1));
  }
};
using Metric = MetricAs<V>;

/// Of the lanes from where `at` points to in a batch of metrics (kMetricBatch).
HWY_INLINE Metric load_metric(const double* at) {
  return {load(at + metric_batch::kWeight), load(at + metric_batch::kAlong),
          load(at + metric_batch::kAlong + 8)};
}
HWY_INLINE void store_metric(const Metric& m, double* at) {
  store(m.w, at + metric_batch::kWeight);
  store(m.u0, at + metric_batch::kAlong), store(m.u1, at + metric_batch::kAlong + 8);
}

/// x / s, 0 where s is.
HWY_INLINE V over_square(V x, V s) { return hn::IfThenElseZero(hn::Gt(s, zero()), hn::Div(x, s)); }

/// Of the residual r, s = |r|^2.
HWY_INLINE Metric metric_of(const Rho& rho, const V* r, V s) {
  const V by = hn::Sqrt(hn::Mul(rho.weight, over_square(hn::Sub(set(1.0), rho.along), s)));
  return {rho.weight, hn::Mul(by, r[0]), hn::Mul(by, r[1])};
}

/// The same of rows by pixels.
HWY_INLINE Metric weighed(const Metric& m, V inverse_sigma) {
  return {hn::Mul(m.w, hn::Mul(inverse_sigma, inverse_sigma)), hn::Mul(m.u0, inverse_sigma),
          hn::Mul(m.u1, inverse_sigma)};
}

/// N and what it makes of the residual: N e = root (e - shorter r (r . e)), and longer r.
struct LossRows {
  V root, shorter, longer;
  V r[2];
  Rho rho;

  /// Of the residual r in sigmas, s = |r|^2.
  HWY_INLINE LossRows(const LossLanes& loss, const V* residual, V s)
      : r{residual[0], residual[1]}, rho(rho_lanes(loss, s)) {
    root = hn::Sqrt(rho.weight);
    const V along = hn::Sqrt(rho.along);
    shorter = over_square(hn::Sub(set(1.0), along), s);
    longer = hn::Div(root, along);
  }
  HWY_INLINE void column(V& j0, V& j1) const {
    const V along = hn::Mul(shorter, fma(r[0], j0, hn::Mul(r[1], j1)));
    j0 = hn::Mul(root, fnma(r[0], along, j0));
    j1 = hn::Mul(root, fnma(r[1], along, j1));
  }
  /// Columns come by pixels, so many of which count as one.
  HWY_INLINE void weigh_columns(V inverse_sigma) { root = hn::Mul(root, inverse_sigma); }
  HWY_INLINE void residual(V* out) const {
    out[0] = hn::Mul(longer, r[0]), out[1] = hn::Mul(longer, r[1]);
  }
};

/// N of a metric alone: N e = root e - u (lesser (u . e)), 0 where the weight is.
struct MetricRoot {
  V root, lesser;

  MetricRoot() = default;
  HWY_INLINE explicit MetricRoot(const Metric& m) {
    const auto seen = hn::Gt(m.w, zero());
    const V u2 = fma(m.u0, m.u0, hn::Mul(m.u1, m.u1));
    const V along = hn::Max(zero(), hn::Sub(set(1.0), hn::Div(u2, m.w)));
    root = hn::Sqrt(m.w);
    lesser = hn::IfThenElseZero(
        seen, hn::Div(set(1.0), hn::Mul(root, hn::Add(set(1.0), hn::Sqrt(along)))));
  }
  HWY_INLINE void column(const Metric& m, V& j0, V& j1) const {
    const V along = hn::Mul(lesser, fma(m.u0, j0, hn::Mul(m.u1, j1)));
    j0 = fnma(m.u0, along, hn::Mul(root, j0));
    j1 = fnma(m.u1, along, hn::Mul(root, j1));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
