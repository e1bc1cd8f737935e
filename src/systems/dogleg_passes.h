// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "eliminate/dogleg_kernels.h"
#include "lists/columns.h"
#include "systems/implicit_solver.h"
#include "systems/product_sums.h"

namespace sheaf {

/// Passes over the observations that a dogleg needs beyond those of a damped step, at the state
/// that was eliminated last. Steepest descent of cameras and points together in the metric C =
/// clamp(diag(J^T J)) is v = C^-1 beta with beta = -J^T r; the points' part of v is not stored, it
/// is in their factors.
class DoglegPasses {
 public:
  DoglegPasses(const Columns& columns, const HeldState& state, bool points_held,
               const Kernels& kernels, Threads& threads);

  // Both leave their direction as the step in the camera records.

  /// v. damping: D of each column, lambda C; the points' factors hold the same lambda.
  void descend(const double* damping, double lambda);
  /// Sum over points of d^T D d, where they follow this step of the cameras.
  double point_damping(const Buffer<double>& step);

  const Buffer<double>& direction() const { return direction_; }  ///< of the cameras, by column
  double gradient2() const { return gradient2_; }                 ///< beta^T C^-1 beta = |v|_C^2
  double curvature() const { return curvature_; }                 ///< |J v|^2
  std::uint64_t bytes() const { return sums_.bytes() + direction_.bytes(); }

 private:
  ProductInput state() const;
  void write_steps(const Buffer<double>& columns);
  void sum_gradient();
  void sum_curvature(double lambda);

  const Columns& columns_;
  HeldState state_;
  const bool points_held_;
  const DoglegKernels& kernels_;
  Threads& threads_;
  ProductSums sums_;
  Buffer<double> direction_;
  double gradient2_ = 0, curvature_ = 0;
};

}  // namespace sheaf
