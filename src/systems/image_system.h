// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "eliminate/image_kernels.h"
#include "lists/columns.h"
#include "lists/image_batches.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "systems/camera_stage.h"
#include "systems/camera_state.h"
#include "systems/costs.h"
#include "systems/home.h"

namespace sheaf {

/// Points held and no lens shared: each image is a small problem of its own, nine unknowns or
/// fewer. There is nothing to eliminate and nothing to substitute back, so the cost of a tried
/// state and its normal equations come out of one pass: a step that is accepted has linearised
/// already. The order of every sum is fixed by the problem.
class ImageSystem : public Home {
 public:
  /// image_camera: the set of parameters (f, k1, k2) of each image. watch_behind: count in each
  /// trial the observations that newly go behind their camera. Throws std::bad_alloc.
  ImageSystem(CameraState start, std::vector<std::uint32_t> image_camera, ImageBatches batches,
              Columns columns, bool watch_behind, const ImageKernels& kernels, Threads& threads);

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;
  HomeHistory history() const override { return {stage_.history()}; }
  bool restore(const HomeHistory& history) override { return stage_.restore(history.stage); }
  const CameraState& cameras() const override { return held_.cameras; }
  void store_points(std::vector<double>&) const override {}
  std::uint64_t count_behind() override;
  std::uint64_t bytes() const override;

  /// Of what it holds, counted before it is allocated.
  static std::uint64_t bytes(std::uint64_t images, std::uint64_t columns, std::uint64_t batches);

 private:
  struct State {
    CameraState cameras;
    Buffer<double> records;  ///< 16 per image: the first fields of a camera record
    Buffer<double> sums;     ///< image_sums::kCount per piece
  };

  void write_records(State& state) const;
  void linearize(State& state);
  ReducedSums gather(const State& state);
  std::uint64_t count_newly_behind() const;
  Costs costs_of(const State& state) const;

  const ImageBatches batches_;
  const Columns columns_;
  const std::vector<std::uint32_t> image_camera_;
  const CameraColumns camera_columns_;
  const bool watch_behind_;
  const ImageKernels& kernels_;
  Threads& threads_;
  bool lenses_free_;
  State held_, tried_;
  bool linearized_ = false;  ///< held_.sums are of the held state under loss_
  double stretch_ = 1;       ///< of the last proposal
  ScaledLoss loss_;
  Buffer<double> diagonal_;  ///< kDiagonalDoubles per image
  CameraStage stage_;
};

}  // namespace sheaf
