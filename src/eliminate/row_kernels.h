// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "eliminate/kernels.h"
#include "rows/photometric.h"
#include "rows/row_layout.h"

namespace sheaf {

/// Rows that were computed once and are kept: what observations of any kind hand to elimination.
/// Either they are stored; or they are those of patches, one observation each, and made again from
/// the patches' factors: reading a fifth of the bytes takes longer than the arithmetic.
struct KeptRows {
  const double* stored = nullptr;             ///< kRowBatch per batch; or nullptr, and:
  const PhotometricInput* patches = nullptr;  ///< at the state that they were read at
  const double* factors = nullptr;            ///< patch_factors(patches->brightness) per batch
};

struct StoredRowsInput {
  const Batches* batches;
  KeptRows rows;
  double damping;  ///< as in EliminateInput
  bool points_held;
  bool poses;  ///< blocks are poses alone: records are for pose_diagonal and pose pairs
  const double* own_damping = nullptr;  ///< as EliminateInput
};

struct RowTrialInput {
  const Batches* batches;
  KeptRows rows;
  const double* steps;    ///< kBlockVector per block
  const double* points;   ///< held
  const double* factors;  ///< as elimination left them
};

/// One instruction set's kernels over one chunk of kept rows. Elimination shares every line with
/// that of reprojection from where the rows are known.
struct RowKernels {
  const char* name;
  int lanes;  ///< of a part: what the rows' places depend on (rows/row_layout.h)
  /// As Kernels::linearize from there on: factors the points and writes the records; adds to
  /// out.point_decrease and out.gradient_max2.
  void (*eliminate)(const StoredRowsInput&, const Chunk&, const Records&, EliminateOutput& out);
  /// As Kernels::diagonal, of blocks that are poses alone.
  void (*pose_diagonal)(const Chunks&, const Chunk&, const Records&, double* diagonal);
  /// Back-substitutes the chunk's points into out.points; adds to out.damping_term, out.step2_max.
  void (*back_substitute)(const RowTrialInput&, const Chunk&, TrialOutput& out);
  /// y += (U - W (V + D)^-1 W^T) x of the chunk's points, x being the steps, kProductRecord doubles
  /// per block; nothing formed, the rows read or made twice.
  void (*product)(const RowTrialInput&, const Chunk&, double* y);
};
/// Plain scalar code, one observation at a time: the twin that the others are tested against.
const RowKernels& reference_row_kernels();

/// simd_name: as of Kernels; "scalar" gives the reference.
const RowKernels& row_kernels(const char* simd_name);

}  // namespace sheaf
