// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "eliminate/lens_kernels.h"
#include "geometry/rigid_motion.h"
#include "lists/columns.h"
#include "lists/lens_chunks.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/coarse_space.h"
#include "sheaf/problem.h"
#include "systems/camera_stage.h"
#include "systems/plan.h"
#include "systems/quantile.h"
#include "systems/system.h"

namespace sheaf {

/// How a problem with lenses of any model is laid out: observations, lenses, columns.
struct LensArrangement {
  Batches batches;
  LensTracks tracks;
  Columns columns;
};
/// Errors: usage, a track is too long.
Result<LensArrangement> arrange_with_lenses(const Problem& problem, const Fixed& fixed,
                                            const std::vector<std::uint8_t>& skip,
                                            Threads& threads);

struct LensRules {
  bool points_held = false;
  bool watch_behind = false;  ///< count in each trial what newly goes where its lens does not see
  int inner_iterations = 0;
};

/// Reprojection rows through lenses of any model, own or shared. What is left of a chunk after
/// elimination are records of nine columns, as of any rows, but an observation has two or three:
/// its image's and those of its lens's blocks. From the sums on all is as in BundleSystem.
class LensSystem : public System {
 public:
  /// The arrangement must outlive it. Throws std::bad_alloc.
  LensSystem(const Problem& problem, const LensArrangement& arrangement, LensChunks chunks,
             const LensRules& rules, const Plan& plan, const Kernels& kernels, Threads& threads);

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;
  /// Writes the held state into the problem; what is fixed is not touched.
  void store(Problem& problem) const;

 private:
  using Parameters = std::array<double, kMaxCameraParameters>;
  struct State {
    std::vector<RigidMotion<double>> poses;
    std::vector<Parameters> lenses;
    Buffer<double> images, lens_records, points;

    LensState view() const { return {images.data(), lens_records.data(), points.data()}; }
  };

  void fill_state(const Problem& problem);
  static void write_pose(const RigidMotion<double>& pose, double* record);
  static void write_lens(const Parameters& lens, double* record);
  void set_solver(const Plan& plan);
  LensProductInput held_product() const;
  void linearize(const StepRequest& request, std::vector<EliminateOutput>& outputs);
  double step_images();
  double step_lenses();
  std::uint64_t count_newly_unseen() const;
  bool sees(const State& state, std::uint64_t batch, std::uint32_t lane, const double* X) const;
  DigitCounts count_residuals(const QuantileSearch& search);
  double cost_of(double square_sum, double loss_sum) const;
  std::size_t num_slices() const { return chunks_.slices.size() - 1; }

  const LensArrangement& arranged_;
  const LensChunks lists_;
  const Chunks& chunks_;  ///< of lists_
  const LensRules rules_;
  const Kernels& kernels_;
  const LensKernels& lens_kernels_;
  Threads& threads_;
  const bool poses_alone_;  ///< nothing rides with them
  const LensScratch layout_;
  State held_, tried_;
  Buffer<double> factors_, weights_;
  Buffer<double> tiles_, diagonal_;  ///< one set per slice, the first ends up as the sum
  std::vector<Buffer<double>> scratch_;
  Columns pose_columns_;                 ///< of the coarse space
  std::unique_ptr<CoarseSpace> coarse_;  ///< of an iterative solver, where it pays
  CameraStage stage_;
  ScaledLoss loss_;
  double mean_square_ = 0, point_decrease_ = 0, trial_cost_ = 0;
};

}  // namespace sheaf
