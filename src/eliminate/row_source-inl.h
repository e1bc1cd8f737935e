// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Rows that are kept, as the point pass (point_pass-inl.h) takes them: from where they are stored,
// or made again from patches.
#if defined(SHEAF_ELIMINATE_ROW_SOURCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_ROW_SOURCE_INL_H_
#undef SHEAF_ELIMINATE_ROW_SOURCE_INL_H_
#else
#define SHEAF_ELIMINATE_ROW_SOURCE_INL_H_
#endif

#include "eliminate/group_part-inl.h"
#include "eliminate/records-inl.h"
#include "eliminate/row_kernels.h"
#include "rows/patch_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

constexpr std::size_t kRowPart = row_field::kCount * kLanes;
static_assert(kRowBatch == kRowPart * kParts);

/// Rows, their points and, for back-substitution, the blocks' steps.
struct RowState {
  const Batches* batches;
  const KeptRows* rows;
  const double* points;
  const double* steps;
  bool poses;  ///< records are for pose_diagonal and pose pairs
};

/// Rows that are stored.
struct StoredRows {
  static constexpr std::size_t kStride = kRowBatch;
  const double* first;

  HWY_INLINE StoredRows(const RowState& in, const GroupPart& of)
      : first(in.rows->stored + kRowBatch * of.first_batch + kRowPart * of.part) {}
  HWY_INLINE LaneJacobian at(std::uint64_t o) const { return restore(first + kRowBatch * o); }
  HWY_INLINE const double* keep(const LaneJacobian&, std::uint64_t, double*) const { return first; }
  static HWY_INLINE void prefetch(const RowState&, const Batches::Group&) {}
};

/// Rows of patches.
template <bool kBrightness, bool kRays>
struct PatchRows {
  static constexpr std::size_t kStride = kRowPart;
  const PhotometricInput& patches;
  const double* factors;
  const GroupPart& of;
  LanePoints X;

  HWY_INLINE PatchRows(const RowState& in, const GroupPart& part)
      : patches(*in.rows->patches),
        factors(in.rows->factors),
        of(part),
        X(load_points<kRays>(patches, part.group, part.lane())) {}
  HWY_INLINE LaneJacobian at(std::uint64_t o) const {
    return rows_again<kBrightness, kRays>(patches, factors, of.first_batch + o, of.lane(), X);
  }
  HWY_INLINE const double* keep(const LaneJacobian& j, std::uint64_t o, double* room) const {
    save(j, room + kStride * o);
    return room;
  }
  /// Of a group to come: nothing of it can begin without them.
  static HWY_INLINE void prefetch(const RowState& in, const Batches::Group& group) {
    constexpr std::size_t kDoubles = patch_factors(kBrightness);
    const double* from = in.rows->factors + kDoubles * group.first_batch;
    for (std::size_t i = 0; i < kDoubles * group.track; i += 8) hwy::Prefetch(from + i);
  }
};

/// use(Kept) with the right one of these.
template <class Use>
HWY_INLINE void with_kept(const KeptRows& rows, const Use& use) {
  if (rows.stored != nullptr) return use(static_cast<const StoredRows*>(nullptr));
  const bool rays = rows.patches->rays != nullptr;
  if (rows.patches->brightness) {
    if (rays) return use(static_cast<const PatchRows<true, true>*>(nullptr));
    return use(static_cast<const PatchRows<true, false>*>(nullptr));
  }
  if (rays) return use(static_cast<const PatchRows<false, true>*>(nullptr));
  use(static_cast<const PatchRows<false, false>*>(nullptr));
}

/// Nine numbers of each lane's block, kBlockVector apart.
HWY_INLINE void load_block_vector(const double* x, const std::uint32_t* block, std::int32_t uniform,
                                  V* out) {
  if (uniform >= 0) {
    const double* of = x + kBlockVector * static_cast<std::size_t>(uniform);
    broadcast_record(of, out);
    out[8] = set(of[8]);
    return;
  }
  load_records(x, kBlockVector, block, out);
  alignas(64) double last[8];
  for (int l = 0; l < kLanes; ++l) last[l] = x[kBlockVector * block[l] + 8];
  out[8] = load(last);
}

/// e = Jc x.
HWY_INLINE void times_block(const LaneJacobian& j, const V* x, V* e) {
  for (int r = 0; r < 2; ++r) {
    e[r] = hn::Mul(j.camera[r][8], x[8]);
    for (int k = 0; k < 8; ++k) e[r] = fma(j.camera[r][k], x[k], e[r]);
  }
}

/// The observations of a part's points.
template <class Kept>
struct RowSource {
  using State = RowState;
  using KeptRecords = Records;
  static constexpr bool kEvaluates = false, kCountsBehind = false;
  static constexpr int kMostBlocks = 0;

  const State& in;
  const GroupPart& of;
  const Kept kept;

  HWY_INLINE RowSource(const State& at, const GroupPart& part, const V*)
      : in(at), of(part), kept(at, part) {}

  static HWY_INLINE void prefetch(const State& at, const Batches::Group& group) {
    Kept::prefetch(at, group);
  }
  static HWY_INLINE const double* points(const State& at) { return at.points; }
  static HWY_INLINE void begin_chunk(const State&, const Records&) {}
  static HWY_INLINE double* room(const Records& to) { return to.jacobians; }
  static HWY_INLINE Records of_group(const State& at, const Chunk& chunk, std::size_t g,
                                     const Records& records) {
    return records_from(records, at.batches->groups[g].first_batch - chunk.first_batch);
  }

  /// Those of masked lanes are 0.
  HWY_INLINE LaneJacobian rows(std::uint64_t b, const V*, double*) const {
    return kept.at(b - of.first_batch);
  }
  HWY_INLINE const double* keep(const LaneJacobian& j, std::uint32_t o, double* room) const {
    return kept.keep(j, o, room);
  }
  static HWY_INLINE std::size_t stride() { return Kept::kStride; }
  HWY_INLINE void write(const Factor& f, const V* w, const double* rows, const Records& to) const {
    for (std::uint32_t o = 0; o < of.track; ++o) {
      const std::size_t record = 8 * o + static_cast<std::size_t>(of.lane());
      const LaneJacobian j = restore(rows + Kept::kStride * o);
      const Eliminated e(j, f, w);
      if (in.poses)
        write_pose_records(j, e, to.T + kTRecord * record, to.C + kCRecord * record);
      else
        write_records(j, e, to.T + kTRecord * record, to.C + kCRecord * record);
    }
  }

  HWY_INLINE void load_x(const double* x, std::uint64_t b, V* out) const {
    const Batches& batches = *in.batches;
    load_block_vector(x, &batches.image[8 * b + of.lane()], batches.uniform[b], out);
  }
  HWY_INLINE void couple(std::uint64_t b, const double*, V* s) const {
    V x[9], e[2];
    load_x(in.steps, b, x);
    const LaneJacobian j = kept.at(b - of.first_batch);
    times_block(j, x, e);
    for (int i = 0; i < 3; ++i) s[i] = fma(j.point[0][i], e[0], fma(j.point[1][i], e[1], s[i]));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
