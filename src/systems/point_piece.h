// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "platform/buffer.h"
#include "reduced/coarse_space.h"
#include "systems/camera_state.h"
#include "systems/point_rows.h"
#include "systems/system.h"

namespace sheaf {

/// What happens to the points in a step.
struct PointRules {
  bool held = false;
  /// Count in each trial the observations that newly go behind their camera.
  bool watch_behind = false;
  int inner_iterations = 0;            ///< of each point by itself, once the cameras have stepped
  ChartBase charts = ChartBase::none;  ///< what their local coordinates are about
  bool crosses = true;                 ///< whether a step may take them through infinity
};

/// The point pass over some points and the images that see them: a whole scene on one machine, or
/// one of the pieces that a scene is split into, whose images may be other pieces' too. It
/// eliminates its points into sums over its own blocks, has the points follow a step of the cameras
/// and holds the state of both; what becomes of the sums, and where steps come from, is not its
/// business. The order of every sum is fixed by the arrangement: chunks within a slice in order,
/// slices in order; so the bytes do not depend on the number of threads.
class PointPiece {
 public:
  /// Throws std::bad_alloc. points: 3 for each of the problem's, while the constructor runs.
  PointPiece(std::unique_ptr<PointRows> rows, CameraState cameras,
             const std::vector<double>& points, const PointRules& rules, Threads& threads);

  /// What elimination came to.
  struct Eliminated {
    double square_sum = 0, loss_sum = 0;  ///< of the observations
    double point_decrease = 0;            ///< the points' part of twice the promised decrease
    double gradient2 = 0;  ///< largest squared entry of the points' whitened gradients
  };
  /// Linearises the held state and eliminates the points under the request's damping. coarse: takes
  /// its sums from the same pass; or null.
  Eliminated eliminate(const StepRequest& request, const ScaledLoss& loss, double rounding,
                       CoarseSpace* coarse);
  /// Of the last elimination.
  const ReducedSums& sums() const { return sums_; }

  /// How points are to follow, as far as the piece knows: the caller adds what the step is.
  PointTrial trial_rules(const StepRequest& request, double mean_square) const;
  /// What the tried state came to; damping_term: sum over points of n^T D n.
  struct Tried {
    double square_sum = 0, loss_sum = 0, damping_term = 0, left_decrease = 0, step2 = 0;
    std::uint64_t newly_behind = 0;
  };
  /// state().tried.cameras has stepped, by `step` of the solved columns; the points follow.
  Tried follow(const Buffer<double>& step, const PointTrial& rules);
  /// The damping term goes on from `sum`, slice by slice: the order of a sum that decides.
  double add_damping_terms(double sum) const;
  void accept();

  /// Begins again at another state, as a new piece would.
  void restart(const CameraState& cameras, const std::vector<double>& points);
  /// Homogeneous points are about this frame of the scene.
  void place_charts(const SceneFrame& frame);
  /// Writes the held points; those that nothing sees are not touched.
  void store_points(std::vector<double>& points) const;

  PointRows& rows() { return *rows_; }
  const PointRows& rows() const { return *rows_; }
  SteppedState& state() { return state_; }
  const SteppedState& state() const { return state_; }
  const PointRules& rules() const { return rules_; }
  std::size_t num_slices() const { return rows_->chunks().slices.size() - 1; }
  std::uint64_t bytes() const;

 private:
  void fill_points(const std::vector<double>& points);
  void allocate_for_loss();
  void pass(const StepRequest& request, CoarseSpace* coarse);

  const std::unique_ptr<PointRows> rows_;
  const PointRules rules_;
  Threads& threads_;
  SteppedState state_;
  ChartRules chart_;                         ///< of the points' steps
  ScaledLoss loss_;                          ///< of the last elimination
  Buffer<double> tiles_, diagonal_;          ///< one set per slice, the first ends up as the sum
  std::vector<Buffer<double>> scratch_;      ///< one per thread
  std::vector<EliminateOutput> eliminated_;  ///< one per slice
  std::vector<TrialOutput> trials_;          ///< one per slice
  ReducedSums sums_{};
};

}  // namespace sheaf
