// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "geometry/loss.h"
#include "lists/image_batches.h"

namespace sheaf {

/// Sums over a piece of an image's observations, J = Jc (2 x 9; rho, phi, f, k1, k2): the lower
/// triangle of sum J^T J row by row (45), sum J^T r (9), sum |r|^2, sum rho(|r|^2). With a loss,
/// rows are those of its metric (geometry/row_metric.h).
namespace image_sums {
constexpr int kGradient = 45, kSquare = 54, kLoss = 55;
constexpr std::size_t kCount = 56;
constexpr int entry(int row, int column) { return row * (row + 1) / 2 + column; }
}  // namespace image_sums

/// One instruction set's kernels for images with their points held. `batches`: kBatchDoubles each;
/// `camera`: the first 15 fields of a camera record (eliminate/kernels.h).
struct ImageKernels {
  const char* name;
  /// Writes image_sums::kCount doubles; with `lens` false, none of the rows 6 to 8 (left at 0).
  void (*sum)(const double* batches, const ImageBatches::Piece&, const double* camera,
              const ScaledLoss&, bool lens, double* sums);
  /// |r_x| of a batch's eight lanes, then |r_y|: 16 per batch, masked lanes included.
  void (*residuals)(const double* batches, const ImageBatches::Piece&, const double* camera,
                    double* out);
};

/// Plain scalar code: the twin that the others are tested against.
const ImageKernels& reference_image_kernels();

/// Those of the instruction set of this name among available_kernels().
const ImageKernels& image_kernels(const char* name);

}  // namespace sheaf
