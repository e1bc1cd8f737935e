// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The records of elimination, from whose products the sums are made (docs/math.md).
#if defined(SHEAF_ELIMINATE_RECORDS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_RECORDS_INL_H_
#undef SHEAF_ELIMINATE_RECORDS_INL_H_
#else
#define SHEAF_ELIMINATE_RECORDS_INL_H_
#endif

#include "eliminate/factor-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

HWY_INLINE void scale_rows(V by, LaneJacobian& j) {
  for (int r = 0; r < 2; ++r) {
    j.r[r] = hn::Mul(j.r[r], by);
    for (V& x : j.point[r]) x = hn::Mul(x, by);
    for (V& x : j.camera[r]) x = hn::Mul(x, by);
  }
}

/// The records of a chunk's batch and of what follows it.
HWY_INLINE Records records_from(const Records& of, std::uint64_t batch) {
  return {of.T + kTRecord * 8 * batch, of.C + kCRecord * 8 * batch, of.jacobians};
}

/// One observation per lane, seen through its point's elimination: B = Jp L^-T, the factor Lm of
/// M = I - B B^T with its diagonal inverted too, and h = Lm^-1 (r + B w).
struct Eliminated {
  V b[2][3], l00, l10, l11, i0, i1, h0, h1;

  HWY_INLINE Eliminated(const LaneJacobian& j, const Factor& f, const V* w) {
    for (int r = 0; r < 2; ++r) forward(f, j.point[r], b[r]);
    const V q0 = fma(b[0][0], w[0], fma(b[0][1], w[1], fma(b[0][2], w[2], j.r[0])));
    const V q1 = fma(b[1][0], w[0], fma(b[1][1], w[1], fma(b[1][2], w[2], j.r[1])));
    const V one = set(1.0), tiny = set(1e-20);
    V m00 = fnma(b[0][0], b[0][0], fnma(b[0][1], b[0][1], fnma(b[0][2], b[0][2], one)));
    V m01 = hn::Neg(fma(b[0][0], b[1][0], fma(b[0][1], b[1][1], hn::Mul(b[0][2], b[1][2]))));
    V m11 = fnma(b[1][0], b[1][0], fnma(b[1][1], b[1][1], fnma(b[1][2], b[1][2], one)));
    m00 = hn::Max(m00, tiny);
    i0 = inverse_sqrt(m00);
    l00 = hn::Mul(m00, i0), l10 = hn::Mul(m01, i0);
    m11 = hn::Max(fnma(l10, l10, m11), tiny);
    i1 = inverse_sqrt(m11);
    l11 = hn::Mul(m11, i1);
    h0 = hn::Mul(q0, i0);
    h1 = hn::Mul(fnma(l10, h0, q1), i1);
  }
  /// Column i of C and of T.
  HWY_INLINE V c0(const LaneJacobian& j, int i) const {
    return fma(l00, j.camera[0][i], hn::Mul(l10, j.camera[1][i]));
  }
  HWY_INLINE V c1(const LaneJacobian& j, int i) const { return hn::Mul(l11, j.camera[1][i]); }
  HWY_INLINE V t(const LaneJacobian& j, int q, int i) const {
    return fma(j.camera[0][i], b[0][q], hn::Mul(j.camera[1][i], b[1][q]));
  }
};

/// Writes the T and C records of one observation per lane.
HWY_INLINE void write_records(const LaneJacobian& j, const Eliminated& e, double* T, double* C) {
  V fields[8], last[8];
  for (int i = 0; i < 8; ++i) fields[i] = e.c0(j, i);
  store_records(fields, C, kCRecord);
  for (int i = 0; i < 8; ++i) fields[i] = e.c1(j, i);
  store_records(fields, C + c_record::row(1), kCRecord);
  for (int q = 0; q < 3; ++q) {
    for (int i = 0; i < 8; ++i) fields[i] = e.t(j, q, i);
    store_records(fields, T + t_record::column(q), kTRecord);
    last[q] = e.t(j, q, 8);
  }
  last[3] = zero();
  last[4] = e.c0(j, 8);
  last[5] = e.c1(j, 8);
  last[6] = e.h0;
  last[7] = e.h1;
  store_records(last, T + t_record::kRow8, kTRecord);
}

/// As write_records, of blocks that are poses alone: six columns, and h in the seventh of C, so
/// that C^T C has the right-hand side in it. The last eight of T are not written.
HWY_INLINE void write_pose_records(const LaneJacobian& j, const Eliminated& e, double* T,
                                   double* C) {
  V fields[8];
  fields[7] = zero();
  for (int i = 0; i < 6; ++i) fields[i] = e.c0(j, i);
  fields[6] = e.h0;
  store_records(fields, C, kCRecord);
  for (int i = 0; i < 6; ++i) fields[i] = e.c1(j, i);
  fields[6] = e.h1;
  store_records(fields, C + c_record::row(1), kCRecord);
  fields[6] = zero();
  for (int q = 0; q < 3; ++q) {
    for (int i = 0; i < 6; ++i) fields[i] = e.t(j, q, i);
    store_records(fields, T + t_record::column(q), kTRecord);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
