// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "eliminate/kept_product.h"
#include "eliminate/lens_kernels.h"
#include "systems/arrangement.h"
#include "systems/dogleg_passes.h"
#include "systems/point_rows.h"
#include "systems/residual_quantile.h"

namespace sheaf {

/// Reprojections through lenses of any model, own or shared. What is left of a chunk after
/// elimination are records of nine columns, as of any rows, but an observation has two or three:
/// its image's and those of its lens's blocks.
class LensRows : public PointRows {
 public:
  /// All must outlive it.
  LensRows(const Arrangement& arrangement, const Kernels& kernels, Threads& threads);

  const Batches& batches() const override { return arranged_.batches; }
  const Chunks& chunks() const override { return chunks_; }
  std::size_t num_blocks() const override { return arranged_.tracks.num_blocks; }
  std::size_t scratch() const override { return layout_.doubles; }
  void attach(const SteppedState& state) override;
  const double* held_cameras() const override { return held_.images.data(); }
  Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch, double* tiles,
                    double* diagonal, EliminateOutput& out) override;
  void step(const Buffer<double>& columns) override;
  void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) override;
  Costs tried_costs(const PointTrial& in, const Costs& summed, Settling& points,
                    Trial& out) override;
  void accepted() override { std::swap(held_, tried_); }
  double residual_scale(double quantile) const override;
  std::uint64_t count_behind() const override;
  double pixel_rms() const override;
  Operators make_operators(const Columns& columns, bool mixed) override;
  std::unique_ptr<DoglegSource> make_dogleg() override;
  std::uint64_t bytes() const override;

 private:
  class Operator;
  class RoundedOperator;
  class Dogleg;
  struct LensCameras {
    Buffer<double> images, lenses;  ///< kImageRecord, kLensRecord each
  };
  void write_records(const CameraState& cameras, LensCameras& records) const;
  LensState view(const LensCameras& records, const PointState& state) const {
    return {records.images.data(), records.lenses.data(), state.points.data()};
  }
  LensInput held_input() const;
  std::uint64_t count_newly_unseen() const;
  /// Of the observations as (batch, lane, group).
  template <class Counts>
  std::uint64_t count_where(const Counts& counts) const;
  bool sees(const LensCameras& records, const PointState& state, std::uint64_t batch,
            std::uint32_t lane, std::size_t group) const;

  const Arrangement& arranged_;
  const Chunks& chunks_;
  const Kernels& kernels_;
  const LensKernels& lens_kernels_;
  const KeptProduct& kept_product_;
  Threads& threads_;
  const bool poses_alone_;  ///< nothing rides with them
  const LensScratch layout_;
  const CameraColumns columns_;
  const SteppedState* state_ = nullptr;
  LensCameras held_, tried_;
  mutable ResidualScratch residual_scratch_;
};

}  // namespace sheaf
