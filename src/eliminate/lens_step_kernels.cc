// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What steps of the cameras need beyond elimination: implicit products, kept rows, the dogleg's
// sums.
#include <algorithm>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/lens_step_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/lens_dogleg-inl.h"
#include "eliminate/lens_kernels-inl.h"
#include "eliminate/lens_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

void multiply_by_lenses(const LensProductInput& in, const Chunk& chunk, double* saved, double* y) {
  const std::size_t groups = in.of.batches->groups.size();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    prefetch_groups(in.of.at.points, in.factors, 6, g + 1, std::min<std::size_t>(g + 2, groups));
    lens_product_group(in, g, saved, y);
  }
}

void sum_lens_gradient(const LensProductInput& in, const Chunk& chunk, double* sums) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    lens_gradient_group(in, g, sums);
}

void sum_lens_curvature(const LensProductInput& in, double damping, bool points_held,
                        const Chunk& chunk, CurvatureOutput& out) {
  lens_curvature_chunk(in, damping, points_held, chunk, out);
}

double sum_lens_point_damping(const LensProductInput& in, const Chunk& chunk) {
  return lens_point_damping_chunk(in, chunk);
}

void keep_lens_rows(const LensProductInput& in, double unit, const Chunk& chunk, float* rows) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) keep_group(in, unit, g, rows);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();
