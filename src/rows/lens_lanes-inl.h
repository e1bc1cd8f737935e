// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The camera models of geometry/ on lanes: the very same structs, with a value type of eight
// doubles (or what the instruction set has of them).
#if defined(SHEAF_RESIDUAL_LENS_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_LENS_LANES_INL_H_
#undef SHEAF_RESIDUAL_LENS_LANES_INL_H_
#else
#define SHEAF_RESIDUAL_LENS_LANES_INL_H_
#endif

#include <cmath>

#include "geometry/camera_model.h"
#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A value as the camera models calculate with it.
struct Lane {
  V v;

  Lane() = default;
  HWY_INLINE explicit Lane(double x) : v(set(x)) {}
  HWY_INLINE explicit Lane(V x) : v(x) {}
};
struct LaneMask {
  hn::Mask<D> m;
};
HWY_INLINE Lane operator+(const Lane& a, const Lane& b) { return Lane(hn::Add(a.v, b.v)); }
HWY_INLINE Lane operator-(const Lane& a, const Lane& b) { return Lane(hn::Sub(a.v, b.v)); }
HWY_INLINE Lane operator*(const Lane& a, const Lane& b) { return Lane(hn::Mul(a.v, b.v)); }
HWY_INLINE Lane operator/(const Lane& a, const Lane& b) { return Lane(hn::Div(a.v, b.v)); }
HWY_INLINE Lane operator-(const Lane& a) { return Lane(hn::Neg(a.v)); }
HWY_INLINE LaneMask operator<(const Lane& a, const Lane& b) { return {hn::Lt(a.v, b.v)}; }
HWY_INLINE Lane select(const LaneMask& condition, const Lane& yes, const Lane& no) {
  return Lane(hn::IfThenElse(condition.m, yes.v, no.v));
}
HWY_INLINE Lane sqrt(const Lane& a) { return Lane(hn::Sqrt(a.v)); }
HWY_INLINE Lane floor(const Lane& a) { return Lane(hn::Floor(a.v)); }

/// Of 0 <= q <= 1, within 2 ulp: tan(k pi / 8 + t) with |t| <= pi / 16, then the series of t.
HWY_INLINE V atan_unit(V q) {
  const V eighth = set(0.41421356237309504880);                     // tan(pi / 8)
  const auto past_first = hn::Gt(q, set(0.19891236737965800691));   // tan(pi / 16)
  const auto past_second = hn::Gt(q, set(0.66817863791929891999));  // tan(3 pi / 16)
  const V c = hn::IfThenElse(past_second, set(1.0), hn::IfThenElse(past_first, eighth, zero()));
  const V base = hn::IfThenElse(past_second, set(0.78539816339744830962),
                                hn::IfThenElse(past_first, set(0.39269908169872415481), zero()));
  const V t = hn::Div(hn::Sub(q, c), fma(q, c, set(1.0)));
  const V n = hn::Mul(t, t);
  V sum = set(1.0 / 21);  // n < 0.0396: the first term left out is below 2e-17
  for (int k = 19; k >= 3; k -= 2) sum = fnma(n, sum, set(1.0 / k));
  return hn::Add(base, fnma(hn::Mul(t, n), sum, t));
}

/// The angle of (x, y) in [-pi, pi], within 4 ulp; y = 0 with x < 0 is pi.
HWY_INLINE Lane atan2(const Lane& y, const Lane& x) {
  const V up = hn::Abs(y.v), along = hn::Abs(x.v);
  const V most = hn::Max(hn::Max(up, along), set(1e-300));
  V angle = atan_unit(hn::Div(hn::Min(up, along), most));
  angle = hn::IfThenElse(hn::Gt(up, along), hn::Sub(set(1.57079632679489661923), angle), angle);
  angle = hn::IfThenElse(hn::Lt(x.v, zero()), hn::Sub(set(3.14159265358979323846), angle), angle);
  return Lane(hn::CopySign(angle, y.v));
}

/// Of a parameter, once for each lens: lane by lane.
HWY_INLINE Lane tan(const Lane& a) {
  alignas(64) double x[8];
  store(a.v, x);
  for (int l = 0; l < kLanes; ++l) x[l] = std::tan(x[l]);
  return Lane(load(x));
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf

#undef SHEAF_LENS_NAMESPACE
#define SHEAF_LENS_NAMESPACE sheaf::HWY_NAMESPACE
#define SHEAF_LENSES_ON_LANES
#include "geometry/lens.h"
// After lens.h:
#include "geometry/lens_switch.h"
#undef SHEAF_LENSES_ON_LANES
#undef SHEAF_LENS_NAMESPACE
#define SHEAF_LENS_NAMESPACE sheaf

namespace sheaf {
namespace HWY_NAMESPACE {

/// What is wanted of a lens; the rest of its results is left as it was.
enum class Wanted { pixel, point, parameters };

/// Writes to `out` what is wanted of the point P in the camera's frame through a lens with the
/// parameters k. Defined in lens_lanes.cc: files of kernels do not repeat the models' bodies.
template <Wanted kWanted>
void project_on_lanes(CameraModel model, const Lane* k, const Lane* P, LensJacobian<Lane>& out);

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
