// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The losses on lanes; geometry/loss.h is the scalar statement of the same formulas.
#if defined(SHEAF_RESIDUAL_LOSS_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_LOSS_LANES_INL_H_
#undef SHEAF_RESIDUAL_LOSS_LANES_INL_H_
#else
#define SHEAF_RESIDUAL_LOSS_LANES_INL_H_
#endif

#include "geometry/loss.h"
#include "platform/log1p-inl.h"
#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A loss with its constants in registers.
struct LossLanes {
  LossKind kind;
  V c2, inverse_c2, floor;

  HWY_INLINE explicit LossLanes(const ScaledLoss& loss) : kind(loss.kind) {
    floor = set(loss.floor);
    c2 = set(loss.scale_px * loss.scale_px);
    inverse_c2 = set(1 / (loss.scale_px * loss.scale_px));
  }
};

struct Rho {
  V value, weight;  ///< rho and rho'
  V along;          ///< 1 + 2 rho'' s / rho', not below the loss's floor (geometry/row_metric.h)
};

/// Of s = |r|^2 per lane; what is not used of it costs nothing. The switch takes one way for all
/// lanes of all batches.
HWY_INLINE Rho rho_lanes(const LossLanes& loss, V s) {
  const V one = set(1.0);
  const V z = hn::Mul(s, loss.inverse_c2);
  switch (loss.kind) {
    case LossKind::none:
      break;
    case LossKind::huber: {
      const V root = hn::Sqrt(hn::Max(z, one));
      const V beyond = hn::Mul(loss.c2, fms(set(2.0), root, one));
      const auto inside = hn::Le(z, one);
      return {hn::IfThenElse(inside, s, beyond), hn::Div(one, root),
              hn::IfThenElse(inside, one, loss.floor)};
    }
    case LossKind::soft_l1: {
      const V root = hn::Sqrt(hn::Add(one, z)), weight = hn::Div(one, root);
      return {hn::Div(hn::Add(s, s), hn::Add(root, one)), weight,
              hn::Max(loss.floor, hn::Mul(weight, weight))};
    }
    case LossKind::cauchy: {
      const V weight = hn::Div(one, hn::Add(one, z));
      return {hn::Mul(loss.c2, log1p(z)), weight, hn::Max(loss.floor, fms(set(2.0), weight, one))};
    }
    case LossKind::tukey: {
      // c^2 / 3 (1 - (1 - z)^3) = c^2 z (1 - z + z^2 / 3)
      const V bounded = hn::Min(z, one), left = hn::Sub(one, bounded);
      const V cubic = fma(bounded, fms(set(1.0 / 3), bounded, one), one);
      // Where nothing is left of the weight, any value does.
      const V along = hn::Sub(one, hn::Div(hn::Mul(set(4.0), bounded), left));
      return {hn::Mul(hn::Mul(loss.c2, bounded), cubic), hn::Mul(left, left),
              hn::IfThenElse(hn::Gt(left, zero()), hn::Max(loss.floor, along), one)};
    }
    case LossKind::geman_mcclure: {
      const V share = hn::Div(one, hn::Add(one, z));
      return {hn::Mul(s, share), hn::Mul(share, share),
              hn::Max(loss.floor, fms(set(4.0), share, set(3.0)))};
    }
  }
  return {s, one, one};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
