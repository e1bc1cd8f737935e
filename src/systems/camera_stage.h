// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "lists/columns.h"
#include "platform/buffer.h"
#include "reduced/camera_solver.h"
#include "reduced/coarse_space.h"
#include "reduced/reduction.h"
#include "systems/active_bounds.h"
#include "systems/system.h"

namespace sheaf {

/// From the sums of elimination to the camera step, in every home: damping, the solver with its
/// coarse space, what the step promises, and how it is shortened and blended for a dogleg.
class CameraStage {
 public:
  explicit CameraStage(const Columns& columns, const Reduction& reduction = local_reduction());

  void set_solver(std::unique_ptr<CameraSolver> solver) { solver_ = std::move(solver); }
  /// Of an iterative solver, where it pays.
  void set_coarse(std::unique_ptr<CoarseSpace> coarse) { coarse_ = std::move(coarse); }
  CoarseSpace* coarse() { return coarse_.get(); }

  /// Right-hand side and damping of the columns; returns the largest |rhs_i| / |J_i|, the scaled
  /// gradient of the free columns. Columns at a bound that they are pushed against are not free.
  double gather(const ReducedSums& sums, double lambda, std::vector<StepBound> bounds = {});
  /// False where no finite step came out.
  bool solve(const ReducedSums& sums, const StepRequest& request, Step& step);
  /// Conjugate gradients would have stopped at the smaller radius: their path is cut there. True
  /// where the step is another one now.
  bool shorten(const ReducedSums& sums, const StepRequest& request);
  /// The stepped state, of this cost, becomes the held one.
  void moved(double cost);

  /// What one step leaves to the next.
  struct History {
    RecycledModes::History modes;
    std::optional<CoarseSpace::History> coarse;
  };
  History history() const;
  /// Of a stage of the same columns and solver; false where it is of another.
  bool restore(const History& history);

  // Sums over the columns that go on from what the points' parts came to.

  /// Twice the decrease that the linear model promises: sum + step . (b + D step).
  double add_decrease(double sum) const;
  /// sum + step^T D step.
  double add_damping(double sum) const;
  /// sum + step . b.
  double add_promise(double sum) const;
  /// a . b over the columns in their order.
  double dot(const Buffer<double>& a, const double* b) const;

  const Buffer<double>& step() const { return step_; }
  /// newton x step + descent x direction.
  const Buffer<double>& blend(double newton, double descent, const Buffer<double>& direction);
  const double* damping() const { return damping_.data(); }
  /// b - (S + D) step, where an iterative solver left one; else nullptr.
  const double* residual() const { return residual_; }
  bool cut() const { return cut_; }  ///< the step ends at the radius
  std::uint64_t solves() const { return solves_; }
  std::uint64_t bytes() const;

 private:
  bool solve_once(const ReducedSums& sums, const StepRequest& request, Step& step);
  CameraSystem system(const ReducedSums& sums, const StepRequest& request) const;

  const Columns& columns_;
  const Reduction& reduction_;
  CameraVectors vectors_;
  ActiveBounds bounds_;
  Buffer<double> damping_, step_, blended_;
  std::unique_ptr<CoarseSpace> coarse_;
  std::unique_ptr<CameraSolver> solver_;
  const double* residual_ = nullptr;
  bool cut_ = false, corrected_ = false;  ///< corrected: the coarse space could be factored
  std::uint64_t solves_ = 0;
};

}  // namespace sheaf
