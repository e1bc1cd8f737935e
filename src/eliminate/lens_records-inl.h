// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Records of lenses that have blocks of their own. A lens meets a point through all of the
// observations through it at once: with B = Jp L^-T of each,
//   T_l = sum J_l^T B,     S_ll = sum J_l^T (J_l - B T_l^T),     S_al = J_a^T (J_l - B_a T_l^T).
#if defined(SHEAF_ELIMINATE_LENS_RECORDS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_LENS_RECORDS_INL_H_
#undef SHEAF_ELIMINATE_LENS_RECORDS_INL_H_
#else
#define SHEAF_ELIMINATE_LENS_RECORDS_INL_H_
#endif

#include "eliminate/group_part-inl.h"
#include "eliminate/lens_blocks-inl.h"
#include "eliminate/records-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Doubles of one observation's rows, per lane.
HWY_INLINE std::size_t row_fields(const LensTracks& tracks) {
  return row_field::count(tracks.most_blocks);
}

/// A part's sums T_l by slot: 9 x 3 vectors per row, columns of the block first.
class SlotSums {
 public:
  HWY_INLINE SlotSums(double* sums, std::uint32_t rows) : sums_(sums) {
    // One row beyond: where a lens of one block stands last, what would be its second.
    for (std::size_t i = 0; i < kSlotSums / 8 * (std::size_t(rows) + 1); ++i)
      store(zero(), sums + i * kLanes);
  }
  HWY_INLINE double* row(std::size_t row) { return sums_ + kSlotSums / kParts * row; }

  HWY_INLINE void add(std::int32_t uniform, const std::uint16_t* rows, int block, int column,
                      const V* t) {
    if (uniform >= 0) {
      double* to = row(static_cast<std::size_t>(uniform + block)) + 3 * kLanes * column;
      for (int q = 0; q < 3; ++q) add_to(t[q], to + kLanes * q);
      return;
    }
    for (int q = 0; q < 3; ++q) {
      alignas(64) double lanes[8];
      store(t[q], lanes);
      for (int l = 0; l < kLanes; ++l)
        row(std::size_t(rows[l]) + block)[kLanes * (3 * column + q) + l] += lanes[l];
    }
  }
  HWY_INLINE void get(std::int32_t uniform, const std::uint16_t* rows, int block, int column,
                      V* t) {
    if (uniform >= 0) {
      const double* from = row(static_cast<std::size_t>(uniform + block)) + 3 * kLanes * column;
      for (int q = 0; q < 3; ++q) t[q] = load(from + kLanes * q);
      return;
    }
    for (int q = 0; q < 3; ++q) {
      alignas(64) double lanes[8];
      for (int l = 0; l < kLanes; ++l)
        lanes[l] = row(std::size_t(rows[l]) + block)[kLanes * (3 * column + q) + l];
      t[q] = load(lanes);
    }
  }

 private:
  double* sums_;
};

/// The lens records of one observation per lane; block: of its lens, of which no lens has more than
/// `width` columns.
HWY_INLINE void write_lens_records(const double* lens, const Eliminated& m, SlotSums& slots,
                                   std::int32_t uniform, const std::uint16_t* rows, int block,
                                   int width, double* to, std::size_t stride) {
  V C[2][9], G[2][9];
  for (int i = width; i < 9; ++i) C[0][i] = C[1][i] = G[0][i] = G[1][i] = zero();
  for (int i = 0; i < width; ++i) {
    const V j0 = load(lens + kLanes * row_field::lens(block, 0, i));
    const V j1 = load(lens + kLanes * row_field::lens(block, 1, i));
    V t[3];
    slots.get(uniform, rows, block, i, t);
    const V g0 = fnma(m.b[0][0], t[0], fnma(m.b[0][1], t[1], fnma(m.b[0][2], t[2], j0)));
    const V g1 = fnma(m.b[1][0], t[0], fnma(m.b[1][1], t[1], fnma(m.b[1][2], t[2], j1)));
    C[0][i] = fma(m.l00, j0, hn::Mul(m.l10, j1));
    C[1][i] = hn::Mul(m.l11, j1);
    G[0][i] = hn::Mul(g0, m.i0);
    G[1][i] = hn::Mul(fnma(m.l10, G[0][i], g1), m.i1);
  }
  for (int r = 0; r < 2; ++r) {
    store_records(C[r], to + lens_pair_record::kC + 8 * r, stride);
    store_records(G[r], to + lens_pair_record::kG + 8 * r, stride);
  }
  if (width < 9) return;  // not read either
  const V ninths[8] = {C[0][8], C[1][8], G[0][8], G[1][8], zero(), zero(), zero(), zero()};
  store_records(ninths, to + lens_pair_record::kC8, stride);
}

/// The T records of a row of slots.
HWY_INLINE void write_slot_record(const double* sums, double* to) {
  V fields[8], last[8];
  for (int q = 0; q < 3; ++q) {
    for (int i = 0; i < 8; ++i) fields[i] = load(sums + kLanes * (3 * i + q));
    store_records(fields, to + t_record::column(q), kTRecord);
    last[q] = load(sums + kLanes * (24 + q));
  }
  for (int i = 3; i < 8; ++i) last[i] = zero();
  store_records(last, to + t_record::kRow8, kTRecord);
}

/// Where the records of a group's observations and slots go.
struct LensGroupRecords {
  LensRecords of;  ///< T, C and lens: of the group's first observation
  double* slot_T;  ///< of its first slot
};

/// T_l of a part's slots; and of `sums`, where they are wanted, what the rows are to them.
HWY_INLINE void sum_slots(const LensTracks& tracks, const GroupPart& of, const Factor& f,
                          const V* w, const double* rows, SlotSums& slots, const BlockSums& sums) {
  const std::size_t stride = row_fields(tracks) * kLanes;
  for (std::uint32_t o = 0; o < of.track; ++o) {
    const std::uint64_t batch = of.first_batch + o;
    const double *row = rows + stride * o, *lens = row + row_field::kCount * kLanes;
    V b[2][3], e[2];
    for (int r = 0; r < 2; ++r) {
      V point[3];
      for (int q = 0; q < 3; ++q) point[q] = load_field(row, row_field::point(r, q));
      forward(f, point, b[r]);
      e[r] = load_field(row, row_field::residual(r));
      for (int q = 0; q < 3; ++q) e[r] = fma(b[r][q], w[q], e[r]);
    }
    const std::int32_t uniform = tracks.uniform_slot[batch];
    const std::uint16_t* at = &tracks.slot[8 * batch + static_cast<std::size_t>(of.lane())];
    for (int j = 0; j < tracks.most_blocks; ++j) {
      if (sums) sums.add(batch, of.lane(), j, lens, e);
      for (int i = 0; i < tracks.most_width[std::size_t(j)]; ++i) {
        const V j0 = load(lens + kLanes * row_field::lens(j, 0, i));
        const V j1 = load(lens + kLanes * row_field::lens(j, 1, i));
        V t[3];
        for (int q = 0; q < 3; ++q) t[q] = fma(j0, b[0][q], hn::Mul(j1, b[1][q]));
        slots.add(uniform, at, j, i, t);
      }
    }
  }
}

/// All records of a part, of rows as they were kept.
HWY_INLINE void write_part_records(const LensTracks& tracks, const GroupPart& of, const Factor& f,
                                   const V* w, const double* rows, const LensGroupRecords& to) {
  const int lane = of.lane(), blocks = tracks.most_blocks;
  const std::size_t stride = row_fields(tracks) * kLanes;
  const std::size_t each = kLensPairRecord * static_cast<std::size_t>(blocks);
  const BlockSums sums(tracks, to.of.blocks);
  SlotSums slots(to.of.slots, tracks.slots_of(of.group));
  if (blocks > 0) sum_slots(tracks, of, f, w, rows, slots, sums);
  for (std::uint32_t o = 0; o < of.track; ++o) {
    const double* row = rows + stride * o;
    const LaneJacobian j = restore(row);
    const Eliminated e(j, f, w);
    const std::size_t record = 8 * std::size_t(o) + static_cast<std::size_t>(lane);
    write_records(j, e, to.of.image.T + kTRecord * record, to.of.image.C + kCRecord * record);
    if (blocks == 0 || sums) continue;
    const std::int32_t uniform = tracks.uniform_slot[of.first_batch + o];
    const std::uint16_t* at = &tracks.slot[8 * (of.first_batch + o) + std::size_t(lane)];
    for (int b = 0; b < blocks; ++b)
      write_lens_records(row + row_field::kCount * kLanes, e, slots, uniform, at, b,
                         tracks.most_width[std::size_t(b)],
                         to.of.lens + each * record + kLensPairRecord * std::size_t(b), each);
  }
  for (std::uint32_t s = 0; s < tracks.slots_of(of.group); ++s)
    if (sums)
      sums.take(tracks.first_slot[of.group] + s, lane, slots.row(s));
    else
      write_slot_record(slots.row(s), to.slot_T + kTRecord * (8 * s + lane));
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
