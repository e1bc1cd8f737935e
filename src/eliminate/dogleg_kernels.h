// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "eliminate/kernels.h"

namespace sheaf {

/// The direction v = C^-1 (-J^T r), C = clamp(diag(J^T J)): its part of the cameras is the step in
/// the camera records; that of a point is taken from its factor, as it was eliminated.
struct CurvatureInput {
  ProductInput state;
  double damping;    ///< lambda of the factors: D = lambda C
  bool points_held;  ///< they have no part in v
};
struct CurvatureOutput {
  double square_sum = 0;  ///< sum |J v|^2
  double gradient2 = 0;   ///< sum over points of (J^T r)^T C^-1 (J^T r)
};

/// One instruction set's kernels for what a dogleg needs beyond a damped step. Rows carry the
/// the metric of a loss as elimination left it.
struct DoglegKernels {
  const char* name;
  /// Adds -Jc^T r of the chunk's observations to the images' sums, kProductRecord doubles each of
  /// which the nine columns are used.
  void (*gradient)(const ProductInput&, const Chunk&, double* sums);
  void (*curvature)(const CurvatureInput&, const Chunk&, CurvatureOutput& out);
  /// Sum over the chunk's points of d^T D d, d back-substituted from the step in the records.
  double (*point_damping)(const ProductInput&, const Chunk&);
};
/// simd_name: as for the other kernels.
const DoglegKernels& dogleg_kernels(const char* simd_name);

/// Plain scalar code: the twin that the others are tested against.
const DoglegKernels& reference_dogleg_kernels();

}  // namespace sheaf
