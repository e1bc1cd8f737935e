// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Trials of points that lenses of any model see, and the residuals.
#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/lens_trial_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/lens_kernels-inl.h"
#include "eliminate/lens_source-inl.h"
#include "eliminate/point_trial-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

void try_lenses(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  try_points<LensSource>(
      {{in.batches, in.tracks, in.held},
       {in.batches, in.tracks, in.tried},
       in.factors,
       in.metric,
       {false, in.inner_iterations, in.mean_square, in.loss, in.chart, in.blend, in.own}},
      chunk, out);
}

void lens_residuals(const LensInput& at, const Chunk& chunk, double* out) {
  residuals_of<LensSource>(at, chunk, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();
