// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Elimination of points where lenses have blocks of their own. A lens meets a point through all of
// the observations through it at once: with B = Jp L^-T of each,
//   T_l = sum J_l^T B,     S_ll = sum J_l^T (J_l - B T_l^T),     S_al = J_a^T (J_l - B_a T_l^T).
#if defined(SHEAF_LINEAR_LENS_ELIMINATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_ELIMINATE_INL_H_
#undef SHEAF_LINEAR_LENS_ELIMINATE_INL_H_
#else
#define SHEAF_LINEAR_LENS_ELIMINATE_INL_H_
#endif

#include "eliminate/eliminate-inl.h"
#include "eliminate/lens_blocks-inl.h"
#include "eliminate/lens_rows-inl.h"
#include "eliminate/products-inl.h"

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

/// B = Jp L^-T and the factor Lm of I - B B^T, its diagonal inverted too.
struct Whitened {
  V b[2][3], l00, l10, l11, i0, i1;

  HWY_INLINE Whitened(const LaneJacobian& j, const Factor& f) {
    for (int r = 0; r < 2; ++r) forward(f, j.point[r], b[r]);
    const V one = set(1.0), tiny = set(1e-20);
    V m00 = fnma(b[0][0], b[0][0], fnma(b[0][1], b[0][1], fnma(b[0][2], b[0][2], one)));
    const V m01 = hn::Neg(fma(b[0][0], b[1][0], fma(b[0][1], b[1][1], hn::Mul(b[0][2], b[1][2]))));
    V m11 = fnma(b[1][0], b[1][0], fnma(b[1][1], b[1][1], fnma(b[1][2], b[1][2], one)));
    m00 = hn::Max(m00, tiny);
    i0 = inverse_sqrt(m00);
    l00 = hn::Mul(m00, i0), l10 = hn::Mul(m01, i0);
    m11 = hn::Max(fnma(l10, l10, m11), tiny);
    i1 = inverse_sqrt(m11);
    l11 = hn::Mul(m11, i1);
  }
};

/// The lens records of one observation per lane; block: of its lens, of which no lens has more than
/// `width` columns.
HWY_INLINE void write_lens_records(const double* lens, const Whitened& m, SlotSums& slots,
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

/// Where a part of a group's records go.
struct PartOfGroup {
  std::size_t group;
  int part;
  double *T, *C, *lens;  ///< of the group's first observation
  double* slot_T;        ///< of its first slot
};

/// T_l of a part's slots; and of `sums`, where they are wanted, what the rows are to them.
HWY_INLINE void sum_slots(const LensEliminateInput& in, const PartOfGroup& to, const Factor& f,
                          const V* w, const double* rows, SlotSums& slots, const BlockSums& sums) {
  const LensTracks& tracks = *in.of.tracks;
  const Batches::Group& group = in.of.batches->groups[to.group];
  const int lane = to.part * kLanes;
  const std::size_t stride = row_fields(tracks) * kLanes;
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t batch = group.first_batch + o;
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
    const std::uint16_t* at = &tracks.slot[8 * batch + static_cast<std::size_t>(lane)];
    for (int j = 0; j < tracks.most_blocks; ++j) {
      if (sums) sums.add(batch, lane, j, lens, e);
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

HWY_INLINE void write_group_records(const LensEliminateInput& in, const PartOfGroup& to,
                                    const Factor& f, const V* w, const double* rows,
                                    SlotSums& slots, const BlockSums& sums) {
  const LensTracks& tracks = *in.of.tracks;
  const Batches::Group& group = in.of.batches->groups[to.group];
  const int lane = to.part * kLanes, blocks = tracks.most_blocks;
  const std::size_t stride = row_fields(tracks) * kLanes;
  if (blocks > 0) sum_slots(in, to, f, w, rows, slots, sums);
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const double* row = rows + stride * o;
    const LaneJacobian j = restore(row);
    const std::size_t record = 8 * std::size_t(o) + static_cast<std::size_t>(lane);
    write_records(j, f, w, to.T + kTRecord * record, to.C + kCRecord * record);
    if (blocks == 0 || sums) continue;
    const Whitened m(j, f);
    const std::int32_t uniform = tracks.uniform_slot[group.first_batch + o];
    const std::uint16_t* at = &tracks.slot[8 * (group.first_batch + o) + std::size_t(lane)];
    const std::size_t each = kLensPairRecord * static_cast<std::size_t>(blocks);
    for (int b = 0; b < blocks; ++b)
      write_lens_records(row + row_field::kCount * kLanes, m, slots, uniform, at, b,
                         tracks.most_width[std::size_t(b)],
                         to.lens + each * record + kLensPairRecord * static_cast<std::size_t>(b),
                         each);
  }
  for (std::uint32_t s = 0; s < tracks.slots_of(to.group); ++s)
    if (sums)
      sums.take(tracks.first_slot[to.group] + s, lane, slots.row(s));
    else
      write_slot_record(slots.row(s), to.slot_T + kTRecord * (8 * s + lane));
}

template <bool Robust>
HWY_INLINE void eliminate_lens_part(const LensEliminateInput& in, const PartOfGroup& to,
                                    const LensRecords& records, const EliminateOutput& out,
                                    EliminateSums& sums) {
  const Batches& batches = *in.of.batches;
  const LensTracks& tracks = *in.of.tracks;
  const Batches::Group& group = batches.groups[to.group];
  const int lane = to.part * kLanes;
  const double* at = in.of.at.points + kPointGroup * to.group + lane;
  const V X[3] = {load(at), load(at + 8), load(at + 16)};
  const V mask = lane_mask(group.lanes, lane);
  const std::size_t fields = row_fields(tracks);
  PointSums p;
  p.clear();
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    double* row = records.image.jacobians + fields * kLanes * o;
    double* lens = row + row_field::kCount * kLanes;
    LaneJacobian j = lens_rows(in.of, b, lane, X, lens);
    V scale = mask;
    const V square = fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1]));
    sums.square[to.part] = fma(square, mask, sums.square[to.part]);
    if constexpr (Robust) {
      const Rho rho = rho_lanes(LossLanes(in.loss), square);
      sums.loss[to.part] = fma(rho.value, mask, sums.loss[to.part]);
      store(rho.weight, out.weights + 8 * b + lane);
      scale = hn::Mul(mask, hn::Sqrt(rho.weight));
    }
    if (Robust || group.lanes < 8) {
      for (int r = 0; r < 2; ++r) {
        j.r[r] = hn::Mul(j.r[r], scale);
        for (V& x : j.camera[r]) x = hn::Mul(x, scale);
        for (V& x : j.point[r]) x = hn::Mul(x, scale);
      }
      for (std::size_t i = 0; i < fields - row_field::kCount; ++i)
        store(hn::Mul(load(lens + kLanes * i), scale), lens + kLanes * i);
    }
    p.add(j);
    save(j, row);
  }
  EliminateInput settings{};
  settings.damping = in.damping;
  settings.points_held = in.points_held;
  DampedFactor damped;
  damped.compute<false>(settings, p, LaneChart{});
  V w[3];
  forward(damped.f, p.g, w);
  const V w2 = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
  sums.decrease[to.part] = hn::Add(sums.decrease[to.part], w2);
  sums.gradient2[to.part] = hn::Max(sums.gradient2[to.part], w2);
  const Factor& f = damped.f;
  const V all[factor_group::kFields] = {f.i00, f.l10, f.l20, f.i11,       f.l21,       f.i22,
                                        w[0],  w[1],  w[2],  damped.D[0], damped.D[1], damped.D[2]};
  for (int i = 0; i < factor_group::kFields; ++i)
    store(all[i], out.factors + kFactorGroup * to.group + lane + 8 * i);
  SlotSums slots(records.slots, tracks.slots_of(to.group));
  write_group_records(in, to, f, w, records.image.jacobians, slots,
                      BlockSums(tracks, records.blocks));
}

template <bool Robust>
inline void eliminate_lens_chunk(const LensEliminateInput& in, const Chunk& chunk,
                                 const LensRecords& records, EliminateOutput& out) {
  const LensTracks& tracks = *in.of.tracks;
  EliminateSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.decrease[p] = sums.gradient2[p] = zero();
  if (const BlockSums blocks(tracks, records.blocks); blocks) blocks.clear();
  const std::size_t observations = 8 * (chunk.end_batch - chunk.first_batch);
  const std::size_t each = kLensPairRecord * static_cast<std::size_t>(tracks.most_blocks);
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const std::size_t record = 8 * (in.of.batches->groups[g].first_batch - chunk.first_batch);
    const std::size_t slot = observations + 8 * slots_before(tracks, chunk, g);
    for (int part = 0; part < kParts; ++part)
      eliminate_lens_part<Robust>(
          in,
          {g, part, records.image.T + kTRecord * record, records.image.C + kCRecord * record,
           records.lens + each * record, records.image.T + kTRecord * slot},
          records, out, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (Robust) out.loss_sum += sum_parts(sums.loss);
  out.point_decrease += sum_parts(sums.decrease);
  const double gradient2 = max_parts(sums.gradient2);
  out.gradient_max2 = gradient2 > out.gradient_max2 ? gradient2 : out.gradient_max2;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
