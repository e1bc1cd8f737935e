// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Rows on lanes: what any kind of observation hands to elimination, two rows for each lane's point
// and one camera block.
#if defined(SHEAF_RESIDUAL_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_ROWS_INL_H_
#undef SHEAF_RESIDUAL_ROWS_INL_H_
#else
#define SHEAF_RESIDUAL_ROWS_INL_H_
#endif

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The first 8 Octets fields of the 24-double camera records of kLanes images; `image` points at
/// the part's first lane, `uniform` is the image of all lanes or negative.
template <int Octets>
HWY_INLINE void load_cameras(const double* cameras, const std::uint32_t* image,
                             std::int32_t uniform, V* c) {
  if (uniform >= 0) {
    const double* record = cameras + 24 * static_cast<std::size_t>(uniform);
    for (int o = 0; o < Octets; ++o) broadcast_record(record + 8 * o, c + 8 * o);
  } else {
    for (int o = 0; o < Octets; ++o) load_records(cameras + 8 * o, 24, image, c + 8 * o);
  }
}

/// Residual (2), camera Jacobian (2 x 9) and point Jacobian (2 x 3) of one observation per lane.
struct LaneJacobian {
  V r[2], camera[2][9], point[2][3];
};
constexpr int kJacobianFields = 26;

/// kJacobianFields x kLanes doubles.
HWY_INLINE void save(const LaneJacobian& j, double* to) {
  store(j.r[0], to), store(j.r[1], to + kLanes);
  for (int r = 0; r < 2; ++r) {
    for (int i = 0; i < 9; ++i) store(j.camera[r][i], to + (2 + 9 * r + i) * kLanes);
    for (int i = 0; i < 3; ++i) store(j.point[r][i], to + (20 + 3 * r + i) * kLanes);
  }
}

HWY_INLINE LaneJacobian restore(const double* from) {
  LaneJacobian j;
  j.r[0] = load(from), j.r[1] = load(from + kLanes);
  for (int r = 0; r < 2; ++r) {
    for (int i = 0; i < 9; ++i) j.camera[r][i] = load(from + (2 + 9 * r + i) * kLanes);
    for (int i = 0; i < 3; ++i) j.point[r][i] = load(from + (20 + 3 * r + i) * kLanes);
  }
  return j;
}

/// 1 in lanes below `lanes`, 0 beyond, for the part that starts at lane `first`.
HWY_INLINE V lane_mask(std::uint32_t lanes, int first) {
  if (lanes == 8) return set(1.0);
  alignas(64) double ones[8];
  for (int l = 0; l < kLanes; ++l)
    ones[l] = static_cast<std::uint32_t>(first + l) < lanes ? 1.0 : 0.0;
  return load(ones);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
