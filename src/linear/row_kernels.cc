// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/row_kernels.h"

#include <string_view>

#include "platform/simd_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "linear/row_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "linear/eliminate-inl.h"
#include "linear/trial-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

constexpr std::size_t kRowPart = kJacobianFields * kLanes;
static_assert(kRowBatch == kRowPart * kParts);

void eliminate_rows(const StoredRowsInput& in, const Chunk& chunk, const Records& records,
                    EliminateOutput& out) {
  EliminateInput settings{};
  settings.damping = in.damping;
  settings.points_held = in.points_held;
  EliminateSums sums;
  for (int p = 0; p < kParts; ++p) sums.decrease[p] = sums.gradient2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = in.batches->groups[g];
    const std::size_t record = 8 * (group.first_batch - chunk.first_batch);
    for (int part = 0; part < kParts; ++part) {
      const double* rows = in.rows + kRowBatch * group.first_batch + kRowPart * part;
      PointSums p;
      p.clear();
      for (std::uint32_t o = 0; o < group.track; ++o) p.add(restore(rows + kRowBatch * o));
      const LaneChart none{};
      finish_group<false>(settings, p, none, {group.track, g, part}, rows, kRowBatch,
                          records.T + kTRecord * record, records.C + kCRecord * record, out, sums);
    }
  }
  out.point_decrease += sum_parts(sums.decrease);
  const double gradient2 = max_parts(sums.gradient2);
  out.gradient_max2 = gradient2 > out.gradient_max2 ? gradient2 : out.gradient_max2;
}

/// s += Jp^T Jc dc of one observation per lane.
HWY_INLINE void add_row_coupling(const double* rows, const V* step, V* s) {
  const LaneJacobian j = restore(rows);
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
    const double* record = steps + kStepRecord * static_cast<std::size_t>(uniform);
    broadcast_record(record, x);
    x[8] = set(record[8]);
    return;
  }
  load_records(steps, kStepRecord, block, x);
  alignas(64) double last[8];
  for (int l = 0; l < kLanes; ++l) last[l] = steps[kStepRecord * block[l] + 8];
  x[8] = load(last);
}

HWY_INLINE void back_substitute_part(const RowTrialInput& in, const Batches::Group& group,
                                     std::size_t g, int part, double* stepped, V& damping,
                                     V& step2) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  V s[3] = {zero(), zero(), zero()};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V x[9];
    load_steps(in.steps, &batches.image[8 * b + lane], batches.uniform[b], x);
    add_row_coupling(in.rows + kRowBatch * b + kRowPart * part, x, s);
  }
  V d[3];
  const V term = back_substitute(in.factors + kFactorGroup * g + lane, s, d);
  damping = fma(term, lane_mask(group.lanes, lane), damping);
  V moved = zero(), size = set(1e-300);
  for (int i = 0; i < 3; ++i) {
    const std::size_t at = kPointGroup * g + 8 * i + lane;
    const V X = load(in.points + at);
    store(hn::Add(X, d[i]), stepped + at);
    moved = fma(d[i], d[i], moved);
    size = fma(X, X, size);
  }
  step2 = hn::Max(step2, hn::Div(moved, size));
}

void back_substitute_rows(const RowTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  V damping[kParts], step2[kParts];
  for (int p = 0; p < kParts; ++p) damping[p] = step2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p)
      back_substitute_part(in, in.batches->groups[g], g, p, out.points, damping[p], step2[p]);
  out.damping_term += sum_parts(damping);
  const double most = max_parts(step2);
  out.step2_max = most > out.step2_max ? most : out.step2_max;
}

RowKernels row_table(const char* name) {
  return {name, kLanes, &eliminate_rows, &back_substitute_rows};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const RowKernels& row_kernels(const char* simd_name) {
  const std::string_view name = simd_name;
  (void)name;
#if HWY_TARGETS & HWY_AVX3
  static const RowKernels avx512 = N_AVX3::row_table("avx512");
  if (name == avx512.name) return avx512;
#endif
#if HWY_TARGETS & HWY_AVX2
  static const RowKernels avx2 = N_AVX2::row_table("avx2");
  if (name == avx2.name) return avx2;
#endif
#if HWY_TARGETS & HWY_SSE4
  static const RowKernels sse4 = N_SSE4::row_table("sse4");
  if (name == sse4.name) return sse4;
#endif
  static const RowKernels baseline = HWY_STATIC_DISPATCH(row_table)("baseline");
  return baseline;
}

}  // namespace sheaf
#endif  // HWY_ONCE
