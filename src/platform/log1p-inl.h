// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// log(1 + z) on lanes, out of + - * / and bit patterns: the same operations on every instruction
// set, so that those with fused multiply-add agree to the last bit.
#if defined(SHEAF_PLATFORM_LOG1P_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_PLATFORM_LOG1P_INL_H_
#undef SHEAF_PLATFORM_LOG1P_INL_H_
#else
#define SHEAF_PLATFORM_LOG1P_INL_H_
#endif

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Within 3 ulp for 0 <= z < 1e300. What comes out for an infinite z or a NaN means nothing.
HWY_INLINE V log1p(V z) {
  const hn::RebindToUnsigned<D> du;
  const V one = set(1.0), root2 = set(1.41421356237309504880);
  // 1 + z = m 2^e with m in (sqrt(1/2), sqrt(2)]; log m = 2 atanh((m - 1) / (m + 1)).
  const V x = hn::Add(one, z);
  const auto bits = hn::BitCast(du, x);
  // A whole number below 2^52 in the low bits of the pattern of 2^52 is that number plus 2^52.
  V e = hn::Sub(hn::BitCast(D(), hn::Or(hn::ShiftRight<52>(bits), hn::BitCast(du, set(0x1p52)))),
                set(0x1p52 + 1023));
  V m = hn::BitCast(D(),
                    hn::Or(hn::And(bits, hn::Set(du, 0x000fffffffffffffu)), hn::BitCast(du, one)));
  const auto upper = hn::Gt(m, root2);
  m = hn::IfThenElse(upper, hn::Mul(m, set(0.5)), m);
  e = hn::Add(e, hn::IfThenElseZero(upper, one));
  // While e = 0, m - 1 is z: taken as it is, it has not lost the digits that 1 + z rounds off.
  const V f = hn::IfThenElse(hn::Eq(e, zero()), z, hn::Sub(m, one));
  const V s = hn::Div(f, hn::Add(f, set(2.0)));
  const V n = hn::Mul(s, s);
  // n < 0.0295: the first term left out is below 1e-18.
  V sum = set(1.0 / 21);
  for (int k = 19; k >= 3; k -= 2) sum = fma(sum, n, set(1.0 / k));
  // 2 s + 2 s n sum, with f - s f for 2 s: f is exact and what is taken off it small.
  const V log_m = fnma(s, fnma(hn::Add(n, n), sum, f), f);
  // log 2 in two parts: the first has zeros at the end, so that its product with e is exact.
  return fma(e, set(6.93147180369123816490e-01), fma(e, set(1.90821492927058770002e-10), log_m));
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
