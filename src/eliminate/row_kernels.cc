// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/row_kernels.h"

#include <string_view>
#include <type_traits>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/row_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/eliminate-inl.h"
#include "eliminate/trial-inl.h"
#include "rows/patch_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

constexpr std::size_t kRowPart = row_field::kCount * kLanes;
static_assert(kRowBatch == kRowPart * kParts);

/// Where the rows of a group's part come from: from where they are stored ...
struct StoredRows {
  const double* first;

  HWY_INLINE StoredRows(const KeptRows& rows, const Batches::Group& group, std::size_t, int part)
      : first(rows.stored + kRowBatch * group.first_batch + kRowPart * part) {}
  HWY_INLINE LaneJacobian at(std::uint32_t o) const { return restore(first + kRowBatch * o); }
  /// Rows that can be restored, so many doubles apart; `scratch` is room for some.
  HWY_INLINE const double* keep(const LaneJacobian&, std::uint32_t, double*) const { return first; }
  static HWY_INLINE void prefetch(const KeptRows&, const Batches::Group&) {}
  static constexpr std::size_t kStride = kRowBatch;
};

/// ... or from patches.
template <bool kBrightness, bool kRays>
struct PatchRows {
  const PhotometricInput& patches;
  const double* factors;
  std::uint64_t first_batch;
  int lane;
  LanePoints X;

  HWY_INLINE PatchRows(const KeptRows& rows, const Batches::Group& group, std::size_t g, int part)
      : patches(*rows.patches),
        factors(rows.factors),
        first_batch(group.first_batch),
        lane(part * kLanes),
        X(load_points<kRays>(patches, g, lane)) {}
  HWY_INLINE LaneJacobian at(std::uint32_t o) const {
    return rows_again<kBrightness, kRays>(patches, factors, first_batch + o, lane, X);
  }
  HWY_INLINE const double* keep(const LaneJacobian& j, std::uint32_t o, double* scratch) const {
    save(j, scratch + kStride * o);
    return scratch;
  }
  static constexpr std::size_t kStride = kRowPart;
  /// Of a group to come: nothing of it can begin without them.
  static HWY_INLINE void prefetch(const KeptRows& rows, const Batches::Group& group) {
    constexpr std::size_t kDoubles = patch_factors(kBrightness);
    const double* from = rows.factors + kDoubles * group.first_batch;
    for (std::size_t i = 0; i < kDoubles * group.track; i += 8) hwy::Prefetch(from + i);
  }
};

/// use(Source) with the right one of these.
template <class Use>
void with_source(const KeptRows& rows, const Use& use) {
  if (rows.stored != nullptr) return use(static_cast<const StoredRows*>(nullptr));
  const PhotometricInput& in = *rows.patches;
  const bool rays = in.rays != nullptr;
  if (in.brightness) {
    if (rays) return use(static_cast<const PatchRows<true, true>*>(nullptr));
    return use(static_cast<const PatchRows<true, false>*>(nullptr));
  }
  if (rays) return use(static_cast<const PatchRows<false, true>*>(nullptr));
  use(static_cast<const PatchRows<false, false>*>(nullptr));
}

/// a[k] += x[k] v for k < 6.
HWY_INLINE void add_outer6(const double* x, V v, V* a) {
  for (int k = 0; k < 6; ++k) a[k] = fma(set(x[k]), v, a[k]);
}

template <class Source, bool Poses>
void eliminate_from(const StoredRowsInput& in, const Chunk& chunk, const Records& records,
                    EliminateOutput& out) {
  EliminateInput settings{};
  settings.damping = in.damping;
  settings.points_held = in.points_held;
  EliminateSums sums;
  for (int p = 0; p < kParts; ++p) sums.decrease[p] = sums.gradient2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = in.batches->groups[g];
    const std::size_t record = 8 * (group.first_batch - chunk.first_batch);
    if (g + 1 < chunk.end_group) Source::prefetch(in.rows, in.batches->groups[g + 1]);
    for (int part = 0; part < kParts; ++part) {
      const Source source(in.rows, group, g, part);
      const double* rows = nullptr;
      PointSums p;
      p.clear();
      for (std::uint32_t o = 0; o < group.track; ++o) {
        const LaneJacobian j = source.at(o);
        p.add(j);
        rows = source.keep(j, o, records.jacobians);
      }
      const LaneChart none{};
      finish_group<false, Poses>(settings, p, none, {group.track, g, part}, rows, Source::kStride,
                                 records.T + kTRecord * record, records.C + kCRecord * record, out,
                                 sums);
    }
  }
  out.point_decrease += sum_parts(sums.decrease);
  const double gradient2 = max_parts(sums.gradient2);
  out.gradient_max2 = gradient2 > out.gradient_max2 ? gradient2 : out.gradient_max2;
}

void eliminate_rows(const StoredRowsInput& in, const Chunk& chunk, const Records& records,
                    EliminateOutput& out) {
  with_source(in.rows, [&](auto* source) {
    using Source = std::remove_const_t<std::remove_pointer_t<decltype(source)>>;
    (in.poses ? eliminate_from<Source, true> : eliminate_from<Source, false>)(in, chunk, records,
                                                                              out);
  });
}

/// Of records as write_pose_records leaves them; every sum in chains of its own, so that one
/// product need not wait for another's sum.
void pose_diagonal(const Chunks& chunks, const Chunk& chunk, const Records& from, double* sums) {
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun run = chunks.diagonal_runs[i];
    const std::uint16_t* records = &chunks.diagonal[run.first];
    double* block = sums + kDiagonalDoubles * run.image;
    alignas(64) double products[6][8];
    for (int column = 0; column < 8; column += kLanes) {
      V first[6], second[6], squares[3];
      for (int k = 0; k < 6; ++k) first[k] = second[k] = zero();
      for (V& x : squares) x = zero();
      for (std::uint32_t o = 0; o < run.count; ++o) {
        const double* c = from.C + kCRecord * records[o];
        const double* t = from.T + kTRecord * records[o] + column;
        add_outer6(c, load(c + column), first);
        add_outer6(c + c_record::row(1), load(c + c_record::row(1) + column), second);
        for (int q = 0; q < 3; ++q) {
          const V of = load(t + t_record::column(q));
          squares[q] = fma(of, of, squares[q]);
        }
      }
      for (int k = 0; k < 6; ++k) store(hn::Add(first[k], second[k]), products[k] + column);
      add_to(hn::Add(squares[0], hn::Add(squares[1], squares[2])),
             block + diagonal_layout::kSquares + column);
    }
    for (int k = 0; k < 6; ++k) {
      for (int c = 0; c < 6; ++c) block[diagonal_layout::at(k, c)] += products[k][c];
      block[diagonal_layout::right_side(k)] += products[k][6];
    }
  }
}

/// s += Jp^T Jc dc of one observation per lane.
HWY_INLINE void add_row_coupling(const LaneJacobian& j, const V* step, V* s) {
  V e[2];
  for (int r = 0; r < 2; ++r) {
    e[r] = hn::Mul(j.camera[r][8], step[8]);
    for (int k = 0; k < 8; ++k) e[r] = fma(j.camera[r][k], step[k], e[r]);
  }
  for (int i = 0; i < 3; ++i) s[i] = fma(j.point[0][i], e[0], fma(j.point[1][i], e[1], s[i]));
}

HWY_INLINE void load_steps(const double* steps, const std::uint32_t* block, std::int32_t uniform,
                           V* x) {
  if (uniform >= 0) {
    const double* record = steps + kBlockVector * static_cast<std::size_t>(uniform);
    broadcast_record(record, x);
    x[8] = set(record[8]);
    return;
  }
  load_records(steps, kBlockVector, block, x);
  alignas(64) double last[8];
  for (int l = 0; l < kLanes; ++l) last[l] = steps[kBlockVector * block[l] + 8];
  x[8] = load(last);
}

template <class Source>
HWY_INLINE void back_substitute_part(const RowTrialInput& in, const Batches::Group& group,
                                     std::size_t g, int part, double* stepped, V& damping,
                                     V& step2) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  const Source source(in.rows, group, g, part);
  V s[3] = {zero(), zero(), zero()};
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    V x[9];
    load_steps(in.steps, &batches.image[8 * b + lane], batches.uniform[b], x);
    add_row_coupling(source.at(o), x, s);
  }
  V d[3];
  const V term = back_substitute(in.factors + kFactorGroup * g + lane, s, d);
  damping = fma(term, lane_mask(group.lanes, lane), damping);
  V X[3], Y[3];
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = kPointGroup * g + 8 * i + lane;
    X[i] = load(in.points + at);
    Y[i] = hn::Add(X[i], d[i]);
    store(Y[i], stepped + at);
  }
  step2 = hn::Max(step2, relative_step2(X, Y[0], Y[1], Y[2]));
}

template <class Source>
void back_substitute_from(const RowTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  V damping[kParts], step2[kParts];
  for (int p = 0; p < kParts; ++p) damping[p] = step2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    if (g + 1 < chunk.end_group) Source::prefetch(in.rows, in.batches->groups[g + 1]);
    for (int p = 0; p < kParts; ++p)
      back_substitute_part<Source>(in, in.batches->groups[g], g, p, out.points, damping[p],
                                   step2[p]);
  }
  out.damping_term += sum_parts(damping);
  const double most = max_parts(step2);
  out.step2_max = most > out.step2_max ? most : out.step2_max;
}

void back_substitute_rows(const RowTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  with_source(in.rows, [&](auto* source) {
    using Source = std::remove_const_t<std::remove_pointer_t<decltype(source)>>;
    back_substitute_from<Source>(in, chunk, out);
  });
}

constexpr RowKernels row_table() {
  return {set_name(HWY_TARGET), kLanes, &eliminate_rows, &pose_diagonal, &back_substitute_rows};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const RowKernels& row_kernels(const char* simd_name) {
  if (std::string_view(simd_name) == "scalar") return reference_row_kernels();
  static constexpr RowKernels tables[] = SHEAF_TABLES(row_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
