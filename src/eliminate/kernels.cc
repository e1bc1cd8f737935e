// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/kernels.h"

#include "eliminate/kernel_table.h"
#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/bal_source-inl.h"
#include "eliminate/coarse-inl.h"
#include "eliminate/float_product-inl.h"
#include "eliminate/point_trial-inl.h"
#include "eliminate/products-inl.h"
#include "eliminate/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

void linearize(const EliminateInput& in, const Chunk& chunk, const Records& records,
               EliminateOutput& out) {
  eliminate_points<BalSource>({{in.batches, in.cameras, in.points},
                               {in.damping, in.points_held, in.loss, in.chart, in.own_damping}},
                              chunk, records, out);
}

void diagonal(const Batches& batches, const Chunks& chunks, const Chunk& chunk,
              const Records& records, double* sums) {
  diagonal_products(batches, chunks, chunk, records, sums);
}

void pairs(const Chunks& chunks, const Chunk& chunk, const Records& records, double* tiles) {
  pair_products(chunks, chunk, records, tiles);
}

void coarse(const Batches& batches, const Chunk& chunk, const Records& records,
            const CoarseInput& in, double* scratch, double* sums) {
  coarse_products(batches, chunk, records, in, scratch, sums);
}

void trial(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  try_points<BalSource>({{in.batches, in.cameras, in.points},
                         {in.batches, in.trial_cameras, nullptr},
                         in.factors,
                         in.metric,
                         {in.count_newly_behind, in.inner_iterations, in.mean_square, in.loss,
                          in.chart, in.blend, in.own}},
                        chunk, out);
}

void product(const ProductInput& in, const Chunk& chunk, double* saved, double* y) {
  if (in.metric == nullptr)
    product_chunk<false>(in, chunk, saved, y);
  else
    product_chunk<true>(in, chunk, saved, y);
}

void residuals(const Batches& batches, const double* cameras, const double* points,
               const Chunk& chunk, double* out) {
  residuals_of<BalSource>({&batches, cameras, points}, chunk, out);
}

void product_float(const FloatProductInput& in, const Chunk& chunk, float* saved, double* y) {
  if (in.metric == nullptr)
    product_float_chunk<false>(in, chunk, saved, y);
  else
    product_float_chunk<true>(in, chunk, saved, y);
}

double square_sum(const Batches& batches, const double* cameras, const double* points,
                  const Chunk& chunk) {
  const BalState at{&batches, cameras, points};
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) {
      const GroupPart of(at.batches->groups[g], g, p);
      V X[3], square = zero();
      of.load_points(at.points, X);
      for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
        const LaneJacobian j = BalSource::evaluate<false>(at, of, b, X);
        square = hn::Add(square, fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1])));
      }
      if (!of.full()) square = hn::Mul(square, of.mask());
      sums[p] = hn::Add(sums[p], square);
    }
  return sum_parts(sums);
}

std::uint64_t count_behind(const Batches& batches, const double* cameras, const double* points,
                           const Chunk& chunk) {
  const BalState at{&batches, cameras, points};
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) {
      const GroupPart of(at.batches->groups[g], g, p);
      V X[3];
      of.load_points(at.points, X);
      const V one = of.mask();
      for (std::uint64_t b = of.first_batch; b < of.first_batch + of.track; ++b) {
        const auto behind = hn::Gt(BalSource::depth(at, of, b, X), zero());
        sums[p] = hn::Add(sums[p], hn::IfThenElseZero(behind, one));
      }
    }
  return static_cast<std::uint64_t>(sum_parts(sums));
}

constexpr Kernels table() {
  return {set_name(HWY_TARGET),
          HWY_NATIVE_FMA != 0,
          &linearize,
          &diagonal,
          &pairs,
          &coarse,
          &trial,
          &product,
          &product_float,
          &residuals,
          &square_sum,
          &count_behind};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

std::size_t scratch_doubles(const Batches& batches, const Chunks& chunks) {
  return (kTRecord + kCRecord) * 8 * chunks.most_batches + kRowBatch * batches.longest_track;
}

std::size_t product_scratch_doubles(const Batches& batches) {
  return kProductScratch * batches.longest_track;
}

std::size_t coarse_scratch_doubles(const Batches& batches, std::int32_t clusters) {
  return kCoarseScratch * coarse_scratch_clusters(batches, clusters);
}

Records records_in(double* scratch, const Chunks& chunks) {
  double* C = scratch + kTRecord * 8 * chunks.most_batches;
  return {scratch, C, C + kCRecord * 8 * chunks.most_batches};
}

std::vector<const Kernels*> available_kernels() {
  static constexpr Kernels tables[] = SHEAF_TABLES(table);
  std::vector<const Kernels*> out;
  for (const Kernels& of : tables) {
    const std::int64_t target = set_target(of.name);
    if (target == HWY_STATIC_TARGET || (hwy::SupportedTargets() & target) == target)
      out.push_back(&of);
  }
  return out;
}

}  // namespace sheaf
#endif  // HWY_ONCE
