// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "linear/kernels.h"
#include "residual/row_store.h"

namespace sheaf {

/// Rows that were computed once and are kept: what observations of any kind hand to elimination.
struct StoredRowsInput {
  const Batches* batches;
  const double* rows;  ///< kRowBatch per batch
  double damping;      ///< as in EliminateInput
  bool points_held;
};

/// A camera block's step as back-substitution reads it: nine columns, seven unused.
constexpr std::size_t kStepRecord = 16;

struct RowTrialInput {
  const Batches* batches;
  const double* rows;
  const double* steps;    ///< kStepRecord per block
  const double* points;   ///< held
  const double* factors;  ///< as elimination left them
};

/// One instruction set's kernels over one chunk of stored rows. Elimination shares every line with
/// that of reprojection from where the rows are known.
struct RowKernels {
  const char* name;
  int lanes;  ///< of a part: what the rows' places depend on (residual/row_layout.h)
  /// As Kernels::linearize from there on: factors the points and writes the records; adds to
  /// out.point_decrease and out.gradient_max2.
  void (*eliminate)(const StoredRowsInput&, const Chunk&, const Records&, EliminateOutput& out);
  /// Back-substitutes the chunk's points into out.points; adds to out.damping_term, out.step2_max.
  void (*back_substitute)(const RowTrialInput&, const Chunk&, TrialOutput& out);
};
/// simd_name: as of Kernels.
const RowKernels& row_kernels(const char* simd_name);

}  // namespace sheaf
