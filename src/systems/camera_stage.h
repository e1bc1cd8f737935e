// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "lists/columns.h"
#include "platform/buffer.h"
#include "reduced/camera_solver.h"
#include "systems/system.h"

namespace sheaf {

/// From the sums of elimination to the camera step: damping, the solver, and what the step gains.
class CameraStage {
 public:
  explicit CameraStage(const Columns& columns);

  void set_solver(std::unique_ptr<CameraSolver> solver) { solver_ = std::move(solver); }

  /// Right-hand side and damping of the columns; returns the largest |rhs_i| / |J_i|, the scaled
  /// gradient of the free columns.
  double gather(const ReducedSums& sums, double lambda);

  /// False where no finite step came out.
  bool solve(const ReducedSums& sums, const StepRequest& request, const CoarseSpace* coarse,
             Step& step);

  /// Twice the decrease that the linear model promises: sum, of the points, and the cameras' part.
  double add_decrease(double sum) const;

  const Buffer<double>& step() const { return step_; }
  const double* damping() const { return damping_.data(); }
  std::uint64_t solver_bytes() const { return solver_->bytes(); }

 private:
  const Columns& columns_;
  CameraVectors vectors_;
  Buffer<double> damping_, step_;
  std::unique_ptr<CameraSolver> solver_;
};

}  // namespace sheaf
