// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "eliminate/kernels.h"
#include "systems/arrangement.h"
#include "systems/bal_operators.h"
#include "systems/point_rows.h"
#include "systems/residual_quantile.h"

namespace sheaf {

/// Reprojections through BAL's formula: nine columns an image, the kernels that know it alone.
class BalRows : public PointRows {
 public:
  /// All must outlive it. image_camera: the set of parameters (f, k1, k2) of each image.
  BalRows(const Arrangement& arrangement, std::vector<std::uint32_t> image_camera,
          const Kernels& kernels, Threads& threads);

  const Batches& batches() const override { return batches_; }
  const Chunks& chunks() const override { return chunks_; }
  std::size_t num_blocks() const override { return image_camera_.size(); }
  std::size_t scratch() const override { return scratch_doubles(batches_, chunks_); }
  void attach(const SteppedState& state) override;
  const double* held_cameras() const override { return held_.data(); }
  Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch, double* tiles,
                    double* diagonal, EliminateOutput& out) override;
  void step(const Buffer<double>& columns) override;
  void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) override;
  void accepted() override { std::swap(held_, tried_); }
  double residual_scale(double quantile) const override;
  double pixel_rms() const override;
  std::uint64_t count_behind() const override;
  Operators make_operators(const Columns& columns, bool mixed) override;
  std::unique_ptr<DoglegSource> make_dogleg() override {
    return std::make_unique<BalDogleg>(held_state(), kernels_);
  }
  std::uint64_t bytes() const override { return held_.bytes() + tried_.bytes(); }

 private:
  void write_records(const CameraState& cameras, Buffer<double>& records) const;
  BalState held_state();
  bool has_poses_alone() const;

  const Batches& batches_;
  const Chunks& chunks_;
  const std::vector<std::uint32_t> image_camera_;
  const Columns& columns_;
  const Kernels& kernels_;
  void (*const pairs_)(const Chunks&, const Chunk&, const Records&, double* tiles);
  Threads& threads_;
  const SteppedState* state_ = nullptr;
  Buffer<double> held_, tried_;  ///< kCameraRecord per image
  mutable ResidualScratch residual_scratch_;
};

}  // namespace sheaf
