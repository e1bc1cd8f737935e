// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "eliminate/image_kernels.h"
#include "geometry/rigid_motion.h"
#include "lists/columns.h"
#include "lists/image_batches.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/block_diagonal.h"
#include "reduced/camera_solver.h"
#include "sheaf/problem.h"
#include "systems/quantile.h"
#include "systems/system.h"

namespace sheaf {

/// Points held and no lens shared: each image is a small problem of its own, nine unknowns or
/// fewer. There is nothing to eliminate and nothing to substitute back, so the cost of a tried
/// state and its normal equations come out of one pass: a step that is accepted has linearised
/// already. The order of every sum is fixed by the problem.
class ImageSystem : public System {
 public:
  /// watch_behind: count in each trial the observations that newly go behind their camera. Throws
  /// std::bad_alloc.
  ImageSystem(const Problem& problem, ImageBatches batches, Columns columns, bool watch_behind,
              const ImageKernels& kernels, Threads& threads);

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;
  void store(Problem& problem) const;

  /// Observations behind their camera at the held state.
  std::uint64_t count_behind() const;

  /// Of what it holds, counted before it is allocated.
  static std::uint64_t bytes(std::uint64_t images, std::uint64_t columns, std::uint64_t batches);

 private:
  struct State {
    std::vector<RigidMotion<double>> poses;
    std::vector<std::array<double, 3>> lenses;  ///< one for each image
    Buffer<double> cameras;                     ///< kRecord per image
    Buffer<double> sums;                        ///< image_sums::kCount per piece
  };

  void write_record(std::size_t image, State& state) const;
  void linearize(State& state);
  void gather(const State& state);
  double step_images();
  std::uint64_t count_newly_behind() const;
  double cost_of(double square_sum, double loss_sum) const;

  const ImageBatches batches_;
  const Columns columns_;
  const bool watch_behind_;
  const ImageKernels& kernels_;
  Threads& threads_;
  std::vector<std::uint32_t> image_camera_;
  bool lenses_free_;
  State held_, tried_;
  bool linearized_ = false;  ///< held_.sums are of the held state under loss_
  ScaledLoss loss_;
  Buffer<double> diagonal_;  ///< kDiagonalDoubles per image
  CameraVectors vectors_;
  Buffer<double> damping_, step_;
  BlockDiagonal blocks_;
};

}  // namespace sheaf
