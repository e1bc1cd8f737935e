// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "eliminate/dogleg_kernels.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "systems/product_sums.h"

namespace sheaf {

/// What a dogleg asks of one kind of rows, at the state that was eliminated last.
class DoglegSource {
 public:
  virtual ~DoglegSource() = default;
  /// The steps of the solved blocks, kBlockVector for each, for the passes that follow.
  virtual void write_steps(const double* x, std::size_t blocks) = 0;
  /// Adds -J^T r of the cameras, kProductRecord for each block, as points' factors have eliminated
  /// nothing of it.
  virtual void gradient(const Chunk& chunk, double* sums) = 0;
  /// What such sums come to by solved blocks, both kBlockVector for each.
  virtual void gather(const double* sums, std::size_t blocks, double* solved) const {
    std::copy_n(sums, kBlockVector * blocks, solved);
  }
  /// Adds |J v|^2 and the points' part of |v|_C^2.
  virtual void curvature(const Chunk& chunk, double lambda, bool points_held,
                         CurvatureOutput& out) = 0;
  /// |J v|^2 of what is in no chunk.
  virtual double other_curvature() const { return 0; }
  /// Sum over points of d^T D d, where they follow the step.
  virtual double point_damping(const Chunk& chunk) = 0;
};

/// Passes over the observations that a dogleg needs beyond those of a damped step, at the state
/// that was eliminated last. Steepest descent of cameras and points together in the metric C =
/// clamp(diag(J^T J)) is v = C^-1 beta with beta = -J^T r; the points' part of v is not stored, it
/// is in their factors.
class DoglegPasses {
 public:
  /// blocks: of the rows.
  DoglegPasses(std::unique_ptr<DoglegSource> source, const Columns& columns, const Chunks& chunks,
               std::size_t blocks, bool points_held, Threads& threads);

  // Both leave their direction as the step that the source knows.

  /// v. damping: D of each column, lambda C; the points' factors hold the same lambda.
  void descend(const double* damping, double lambda);
  /// Sum over points of d^T D d, where they follow this step of the cameras.
  double point_damping(const Buffer<double>& step);

  const Buffer<double>& direction() const { return direction_; }  ///< of the cameras, by column
  double gradient2() const { return gradient2_; }                 ///< beta^T C^-1 beta = |v|_C^2
  double curvature() const { return curvature_; }                 ///< |J v|^2
  std::uint64_t bytes() const {
    return sums_.bytes() + direction_.bytes() + solved_.bytes() + of_rows_.bytes();
  }

 private:
  void write_steps(const Buffer<double>& columns);
  void sum_gradient();
  void sum_curvature(double lambda);

  const std::unique_ptr<DoglegSource> source_;
  const Columns& columns_;
  const Chunks& chunks_;
  const bool points_held_;
  Threads& threads_;
  ProductSums sums_;
  Buffer<double> direction_;
  Buffer<double> solved_, of_rows_;  ///< kBlockVector per block
  double gradient2_ = 0, curvature_ = 0;
};

}  // namespace sheaf
