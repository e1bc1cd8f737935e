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
#include "systems/point_piece.h"

namespace sheaf {

/// The home of all rows whose points are eliminated, on CPU threads: one piece that has all points,
/// the camera stage, the trial and the dogleg, whatever the rows are.
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
  double pixel_rms() override { return rows().pixel_rms(); }
  const CameraState& cameras() const override { return piece_.state().held.cameras; }
  void store_points(std::vector<double>& points) const override { piece_.store_points(points); }
  std::uint64_t count_behind() override { return rows().count_behind(); }
  std::uint64_t bytes() const override;
  /// How often the camera system was solved so far.
  std::uint64_t camera_solves() const { return stage_.solves(); }

 private:
  void set_solver(const Plan& plan, const Numbering& columns, const Kernels& kernels);
  Step linearize(const StepRequest& request);
  Step collect_step(const StepRequest& request, const PointPiece::Eliminated& eliminated);
  bool only_radius_is_new(const StepRequest& request) const;
  Trial try_step(const DoglegStep& step);
  double less_what_was_left(double predicted) const;
  PointTrial point_trial(const DoglegStep& step) const;
  const Buffer<double>& blend_cameras(const DoglegStep& step);
  DoglegPasses& passes();
  void measure_newton();
  void measure_descent();
  PointRows& rows() { return piece_.rows(); }

  PointPiece piece_;
  const Columns& columns_;
  const CameraColumns camera_columns_;
  const bool float_products_;  ///< until StepRequest::precise
  const bool float_blocks_;    ///< likewise, and then they are no more
  const Reduction& reduction_ = local_reduction();
  Threads& threads_;
  CameraStage stage_;
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
