// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of eliminate/image_kernels.h once more, one observation at a time.
#include <algorithm>
#include <cmath>

#include "eliminate/image_kernels.h"
#include "eliminate/reference_rows.h"

namespace sheaf {
namespace {

Row observe(const double* batches, std::uint32_t batch, std::uint32_t lane, const double* c) {
  const double* z = batches + ImageBatches::kBatchDoubles * batch + lane;
  const Observed o = camera_at(c);
  Row out;
  out.j = project_with_jacobian<double>(o.R, o.t, o.camera, {z[0], z[8], z[16]});
  for (int d = 0; d < 2; ++d) out.r[d] = out.j.pixel[d] - z[24 + 8 * d];
  return out;
}

void sum(const double* batches, const ImageBatches::Piece& piece, const double* camera,
         const ScaledLoss& loss, bool lens, double* sums) {
  std::fill_n(sums, image_sums::kCount, 0.0);
  for (std::uint32_t b = 0; b < piece.batches; ++b) {
    const std::uint32_t lanes = b + 1 == piece.batches ? piece.last_lanes : 8;
    for (std::uint32_t l = 0; l < lanes; ++l) {
      Row o = observe(batches, b, l, camera);
      sums[image_sums::kSquare] += o.square();
      if (loss.kind != LossKind::none) sums[image_sums::kLoss] += apply_loss(loss, o).value;
      for (int row = 0; row < 2; ++row) {
        const double* J = &o.j.camera[9 * row];
        for (int i = 0; i < (lens ? 9 : 6); ++i) {
          sums[image_sums::kGradient + i] += J[i] * o.r[row];
          for (int k = 0; k <= i; ++k) sums[image_sums::entry(i, k)] += J[i] * J[k];
        }
      }
    }
  }
}

void residuals(const double* batches, const ImageBatches::Piece& piece, const double* camera,
               double* out) {
  for (std::uint32_t b = 0; b < piece.batches; ++b)
    for (std::uint32_t l = 0; l < 8; ++l) {
      const Row o = observe(batches, b, l, camera);
      for (int d = 0; d < 2; ++d) out[16 * b + 8 * d + l] = std::fabs(o.r[d]);
    }
}

}  // namespace

const ImageKernels& reference_image_kernels() {
  static const ImageKernels table = {"reference", &sum, &residuals};
  return table;
}

}  // namespace sheaf
