// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "eliminate/kernels.h"
#include "geometry/rigid_motion.h"
#include "lists/batches.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/coarse_space.h"
#include "sheaf/problem.h"
#include "systems/dogleg.h"
#include "systems/dogleg_passes.h"
#include "systems/implicit_solver.h"
#include "systems/plan.h"
#include "systems/quantile.h"
#include "systems/system.h"

namespace sheaf {

/// What happens to the points in a step.
struct PointRules {
  bool held = false;
  /// Count in each trial the observations that newly go behind their camera.
  bool watch_behind = false;
  int inner_iterations = 0;            ///< of each point by itself, once the cameras have stepped
  ChartBase charts = ChartBase::none;  ///< what their local coordinates are about
};

/// Reprojection rows on CPU threads. The order of every sum is fixed by the problem: chunks within
/// a slice in order, slices in order; so the bytes do not depend on the number of threads.
class BundleSystem : public System {
 public:
  /// The batches must outlive it. Throws std::bad_alloc.
  BundleSystem(const Problem& problem, const Batches& batches, Columns columns,
               const PointRules& rules, const Plan& plan, const Kernels& kernels, Threads& threads);
  BundleSystem(const Problem& problem, Batches&& batches, Columns columns, const PointRules& rules,
               const Plan& plan, const Kernels& kernels, Threads& threads) = delete;

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;
  /// Writes the held state into the problem; what is fixed is not touched.
  void store(Problem& problem) const;

  /// Observations behind their camera at the held state.
  std::uint64_t count_behind();
  std::uint64_t bytes() const;
  /// How often the camera system was solved so far.
  std::uint64_t camera_solves() const { return camera_solves_; }

 private:
  void fill_state(const Problem& problem);
  void write_camera_record(std::size_t image, const RigidMotion<double>& pose,
                           const double* parameters, double* records);
  void make_coarse_space(const Plan& plan);
  void place_charts();
  HeldState held_state();
  Step linearize(const StepRequest& request);
  Step collect_step(const StepRequest& request, const std::vector<EliminateOutput>& outputs);
  bool solve_cameras(const StepRequest& request, Step& step);
  CameraSystem camera_system(const StepRequest& request) const;
  void shorten_newton();
  DoglegPasses& passes();
  bool only_radius_is_new(const StepRequest& request) const;
  Trial try_step(const DoglegStep& step);
  double step_cameras(const Buffer<double>& columns);
  const Buffer<double>& blend_cameras(const DoglegStep& step);
  void measure_newton();
  void measure_descent();
  double dot(const Buffer<double>& a, const double* b) const;
  DigitCounts count_residuals(const QuantileSearch& search);
  double cost_of(double square_sum, double loss_sum) const;

  const PointRules rules_;
  const bool float_products_;  ///< until StepRequest::precise
  const Kernels& kernels_;
  Threads& threads_;
  const Batches& batches_;
  Chunks chunks_;
  Columns columns_;

  // The state held and the one tried.
  std::vector<RigidMotion<double>> poses_, trial_poses_;
  std::vector<std::uint32_t> image_camera_;
  std::vector<std::array<double, 3>> lenses_, trial_lenses_;
  Buffer<double> cameras_, trial_cameras_;  ///< kCameraRecord per image
  Buffer<double> points_, trial_points_;    ///< kPointGroup per group

  Buffer<double> factors_;               ///< kFactorGroup per group
  Buffer<double> tiles_, diagonal_;      ///< one set per slice, the first ends up as the sum
  std::vector<Buffer<double>> scratch_;  ///< one per thread
  CameraVectors vectors_;
  ChartRules chart_;  ///< of the points' steps
  Buffer<double> damping_, camera_step_;
  std::unique_ptr<CoarseSpace> coarse_;  ///< of an iterative solver, where it pays
  std::unique_ptr<CameraSolver> solver_;
  double mean_square_ = 0;  ///< 2 cost / observations at the held state
  double trial_cost_ = 0;   ///< of the last state tried
  double point_decrease_ = 0;
  ScaledLoss loss_;  ///< of the last proposal

  // What a smaller radius at the same state is served from.
  StepRequest request_;               ///< the last proposal
  Step step_;                         ///< its answer
  bool proposed_ = false;             ///< from the held state
  const double* residual_ = nullptr;  ///< that an iterative solver left
  std::uint64_t camera_solves_ = 0;
  bool cut_ = false;           ///< and stopped at the radius
  double newton_damping_ = 0;  ///< sum over points of n^T D n
  std::optional<DoglegPlane> plane_;
  std::unique_ptr<DoglegPasses> passes_;  ///< made when a radius first bounds a step
  bool descended_ = false;                ///< passes_ holds this state's steepest descent
  bool corrected_ = false;                ///< the coarse space could be factored
  Buffer<double> blended_step_;

  Buffer<double> weights_;  ///< rho' of the held state, 8 per batch; empty without a loss
};

}  // namespace sheaf
