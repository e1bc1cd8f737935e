// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "reduced/clusters.h"
#include "systems/camera_stage.h"
#include "systems/camera_state.h"
#include "systems/dogleg.h"
#include "systems/dogleg_passes.h"
#include "systems/home.h"
#include "systems/plan.h"
#include "systems/point_rows.h"

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

/// The home of all rows whose points are eliminated, on CPU threads: the point pass over chunks,
/// the camera stage, the trial and the dogleg, whatever the rows are. The order of every sum is
/// fixed by the problem: chunks within a slice in order, slices in order; so the bytes do not
/// depend on the number of threads.
class PointSystem : public Home {
 public:
  /// A problem's cameras and points as they start, and which columns step the cameras.
  struct Start {
    CameraState cameras;
    CameraColumns camera_columns;
    const std::vector<double>* points;  ///< 3 for each point, while the constructor runs
  };
  /// The columns, and columns alone for the coarse space where blocks are more than images.
  struct Numbering {
    const Columns* columns;
    const Columns* coarse;
  };

  /// `columns` and what the rows refer to must outlive it. Throws std::bad_alloc.
  PointSystem(std::unique_ptr<PointRows> rows, Start start, const Numbering& columns,
              const PointRules& rules, const Plan& plan, const Kernels& kernels, Threads& threads);

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;
  HomeHistory history() const override;
  bool restore(const HomeHistory& history) override;
  bool restart(const CameraState& cameras, const std::vector<double>& points) override;
  double pixel_rms() override { return rows_->pixel_rms(); }
  const CameraState& cameras() const override { return state_.held.cameras; }
  void store_points(std::vector<double>& points) const override;
  std::uint64_t count_behind() override { return rows_->count_behind(); }
  std::uint64_t bytes() const override;
  /// How often the camera system was solved so far.
  std::uint64_t camera_solves() const { return stage_.solves(); }

 private:
  void set_solver(const Plan& plan, const Numbering& columns, const Kernels& kernels);
  void fill_points(const std::vector<double>& points);
  void place_charts();
  void allocate_for_loss();
  void allocate_scratch();
  Step linearize(const StepRequest& request);
  void eliminate(const StepRequest& request);
  Step collect_step(const StepRequest& request);
  bool only_radius_is_new(const StepRequest& request) const;
  Trial try_step(const DoglegStep& step);
  double less_what_was_left(double predicted) const;
  PointTrial point_trial(const DoglegStep& step) const;
  const Buffer<double>& blend_cameras(const DoglegStep& step);
  DoglegPasses& passes();
  void measure_newton();
  void measure_descent();
  std::size_t num_slices() const { return rows_->chunks().slices.size() - 1; }

  const std::unique_ptr<PointRows> rows_;
  const Columns& columns_;
  const CameraColumns camera_columns_;
  const PointRules rules_;
  const bool float_products_;  ///< until StepRequest::precise
  const bool float_blocks_;    ///< likewise, and then they are no more
  const Reduction& reduction_ = local_reduction();
  Threads& threads_;
  SteppedState state_;
  ChartRules chart_;                         ///< of the points' steps
  Buffer<double> tiles_, diagonal_;          ///< one set per slice, the first ends up as the sum
  std::vector<Buffer<double>> scratch_;      ///< one per thread
  std::vector<EliminateOutput> eliminated_;  ///< one per slice
  std::vector<TrialOutput> trials_;          ///< one per slice
  CameraStage stage_;
  ReducedSums sums_{};  ///< of the last elimination
  double mean_square_ = 0, point_decrease_ = 0, trial_cost_ = 0;
  double left_decrease_ = 0;  ///< twice what points promised that did not follow the trial's step
  ScaledLoss loss_;           ///< of the last proposal

  // What a smaller radius at the same state is served from.
  StepRequest request_;        ///< the last proposal
  Step step_;                  ///< its answer
  bool proposed_ = false;      ///< from the held state
  double newton_damping_ = 0;  ///< sum over points of n^T D n
  std::optional<DoglegPlane> plane_;
  std::unique_ptr<DoglegPasses> passes_;  ///< made when a radius first bounds a step
  bool descended_ = false;                ///< passes_ holds this state's steepest descent
};

}  // namespace sheaf
