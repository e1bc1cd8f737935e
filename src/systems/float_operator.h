// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "reduced/conjugate_gradients.h"
#include "systems/implicit_solver.h"
#include "systems/product_sums.h"

namespace sheaf {

/// S x with Jacobians recomputed in single precision; the sums over an image's observations are
/// double. The scene is moved and scaled, and x is scaled by its columns, before either is rounded:
/// the result depends on no unit and on no origin.
class FloatImplicitOperator : public ImageOperator {
 public:
  FloatImplicitOperator(const Columns& columns, const HeldState& state, const Kernels& kernels,
                        ProductSums& sums);

  /// Takes the held state, and diag(J^T J) by column to scale x with.
  void prepare(const double* squares);
  void apply(const double* x, double* y) override;
  std::uint64_t bytes() const;

 private:
  double scale_of_step(const double* x) const;
  void write_step(const double* x, double scale, std::size_t image);

  const Columns& columns_;
  HeldState state_;
  const Kernels& kernels_;
  std::size_t images_;
  double origin_[3] = {0, 0, 0}, scale_ = 1;
  const double* squares_ = nullptr;
  Buffer<float> cameras_;  ///< kFloatCameraRecord per image
  ProductSums& sums_;
};

}  // namespace sheaf
