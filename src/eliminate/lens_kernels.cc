// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/lens_kernels.h"

#include <algorithm>
#include <string_view>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/lens_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/lens_kernels-inl.h"
#include "eliminate/lens_products-inl.h"
#include "eliminate/lens_source-inl.h"
#include "eliminate/point_pass-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

void linearize_lenses(const LensEliminateInput& in, const Chunk& chunk, const LensRecords& records,
                      EliminateOutput& out) {
  eliminate_points<LensSource>(
      {in.of, {in.damping, in.points_held, in.loss, in.chart, in.own_damping}}, chunk, records,
      out);
}

void multiply_lenses(const LensTracks& tracks, const LensTiles& tiles_of, const Chunks& chunks,
                     const Chunk& chunk, const LensRecords& records, double* diagonal,
                     double* tiles) {
  lens_products(tracks, tiles_of, chunks, chunk, records, diagonal, tiles);
}

void multiply_poses(const Chunks& chunks, const Chunk& chunk, const Records& records,
                    double* tiles) {
  pose_pair_products(chunks, chunk, records, tiles);
}

constexpr LensKernels lens_table() {
  return {set_name(HWY_TARGET), &linearize_lenses,       &multiply_lenses, &multiply_poses,
          &try_lenses,          &multiply_by_lenses,     &lens_residuals,  &sum_lens_gradient,
          &sum_lens_curvature,  &sum_lens_point_damping, &keep_lens_rows};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {
namespace {

LensSizes sizes_of(const LensTracks& tracks, const Chunks& chunks, bool only_diagonal) {
  LensSizes out{chunks.most_batches, 0, most_group_slots(tracks), only_diagonal};
  for (const Chunk& chunk : chunks.chunks)
    out.slots = std::max<std::size_t>(out.slots, slots_before(tracks, chunk, chunk.end_group));
  return out;
}

}  // namespace

LensScratch::LensScratch(const Batches& batches, const LensTracks& tracks, const Chunks& chunks,
                         const LensTiles& tiles)
    : LensScratch(batches, tracks, sizes_of(tracks, chunks, tiles.of_image.empty())) {}

LensScratch::LensScratch(const Batches& batches, const LensTracks& tracks, const LensSizes& sizes) {
  // More blocks than these are not cleared and flushed for every chunk.
  constexpr std::size_t kFewBlocks = 8;
  const std::size_t all_blocks = lens_blocks(tracks);
  const bool sums = sizes.only_diagonal && all_blocks > 0 && all_blocks <= kFewBlocks;
  const std::size_t observations = 8 * sizes.batches;
  const std::size_t recorded = sums ? 0 : static_cast<std::size_t>(tracks.most_blocks);
  C = kTRecord * (observations + (sums ? 0 : 8 * sizes.slots));
  lens = C + kCRecord * observations;
  slots = lens + kLensPairRecord * recorded * observations;
  blocks = slots + kSlotSums * (sizes.group_slots + 1);
  jacobians = blocks + (sums ? kBlockSums * (all_blocks + 1) : 0);
  doubles = jacobians + product_scratch_doubles(batches, tracks);
}

std::size_t product_scratch_doubles(const Batches& batches, const LensTracks& tracks) {
  return 8 * row_field::count(tracks.most_blocks) * batches.longest_track;
}

const LensKernels& lens_kernels(const char* simd_name) {
  if (std::string_view(simd_name) == "scalar") return reference_lens_kernels();
  static constexpr LensKernels tables[] = SHEAF_TABLES(lens_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
