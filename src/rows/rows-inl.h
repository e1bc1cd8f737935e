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

#include "lists/block_layout.h"
#include "platform/simd-inl.h"
#include "rows/row_layout.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The first 8 Octets fields of the records of kLanes images or lenses; `index` points at the
/// part's first lane, `uniform` is the index of all lanes or negative.
template <int Octets, std::size_t kRecord>
HWY_INLINE void load_state(const double* records, const std::uint32_t* index, std::int32_t uniform,
                           V* c) {
  if (uniform >= 0) {
    const double* record = records + kRecord * static_cast<std::size_t>(uniform);
    for (int o = 0; o < Octets; ++o) broadcast_record(record + 8 * o, c + 8 * o);
  } else {
    for (int o = 0; o < Octets; ++o) load_records(records + 8 * o, kRecord, index, c + 8 * o);
  }
}
template <int Octets>
HWY_INLINE void load_cameras(const double* cameras, const std::uint32_t* image,
                             std::int32_t uniform, V* c) {
  load_state<Octets, kCameraRecord>(cameras, image, uniform, c);
}

/// Residual (2), camera Jacobian (2 x 9) and point Jacobian (2 x 3) of one observation per lane.
struct LaneJacobian {
  V r[2], camera[2][9], point[2][3];
};

/// Field by field (rows/row_layout.h), a part's lanes of each.
HWY_INLINE V load_field(const double* from, int field) { return load(from + field * kLanes); }
HWY_INLINE void store_field(V x, double* to, int field) { store(x, to + field * kLanes); }

/// row_field::kCount x kLanes doubles.
HWY_INLINE void save(const LaneJacobian& j, double* to) {
  for (int r = 0; r < 2; ++r) store_field(j.r[r], to, row_field::residual(r));
  for (int r = 0; r < 2; ++r) {
    for (int i = 0; i < 9; ++i) store_field(j.camera[r][i], to, row_field::camera(r, i));
    for (int i = 0; i < 3; ++i) store_field(j.point[r][i], to, row_field::point(r, i));
  }
}

HWY_INLINE LaneJacobian restore(const double* from) {
  LaneJacobian j;
  for (int r = 0; r < 2; ++r) {
    j.r[r] = load_field(from, row_field::residual(r));
    for (int i = 0; i < 9; ++i) j.camera[r][i] = load_field(from, row_field::camera(r, i));
    for (int i = 0; i < 3; ++i) j.point[r][i] = load_field(from, row_field::point(r, i));
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
