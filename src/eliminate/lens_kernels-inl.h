// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of one instruction set for lenses of any model, each as the field of LensKernels that
// holds it. They stand in several files, which are compiled side by side.
#if defined(SHEAF_ELIMINATE_LENS_KERNELS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_LENS_KERNELS_INL_H_
#undef SHEAF_ELIMINATE_LENS_KERNELS_INL_H_
#else
#define SHEAF_ELIMINATE_LENS_KERNELS_INL_H_
#endif

#include <hwy/highway.h>

#include "eliminate/lens_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

// lens_kernels.cc
void linearize_lenses(const LensEliminateInput& in, const Chunk& chunk, const LensRecords& records,
                      EliminateOutput& out);
void multiply_lenses(const LensTracks& tracks, const LensTiles& tiles_of, const Chunks& chunks,
                     const Chunk& chunk, const LensRecords& records, double* diagonal,
                     double* tiles);
void multiply_poses(const Chunks& chunks, const Chunk& chunk, const Records& records,
                    double* tiles);

// lens_trial_kernels.cc
void try_lenses(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out);
void lens_residuals(const LensInput& at, const Chunk& chunk, double* out);

// lens_step_kernels.cc
void multiply_by_lenses(const LensProductInput& in, const Chunk& chunk, double* saved, double* y);
void sum_lens_gradient(const LensProductInput& in, const Chunk& chunk, double* sums);
void sum_lens_curvature(const LensProductInput& in, double damping, bool points_held,
                        const Chunk& chunk, CurvatureOutput& out);
double sum_lens_point_damping(const LensProductInput& in, const Chunk& chunk);
void keep_lens_rows(const LensProductInput& in, double unit, const Chunk& chunk, float* rows);

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
