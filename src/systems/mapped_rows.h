// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "systems/block_fold.h"
#include "systems/point_rows.h"

namespace sheaf {

/// Rows whose blocks hang on the solved ones by a map that depends on the state: images of rigs on
/// their frames and sensors. The rows know nothing of it; what they sum is folded, and steps and
/// products go through the map.
class MappedRows : public PointRows {
 public:
  /// columns: of the rows' own blocks. solved_chunks: `tiles` alone are set, by this. All must
  /// outlive it.
  MappedRows(std::unique_ptr<PointRows> rows, const Columns& columns, const BlockMap& map,
             bool forms_tiles, const char* simd_name, Threads& threads);

  const Batches& batches() const override { return rows_->batches(); }
  const Chunks& chunks() const override { return rows_->chunks(); }
  std::size_t num_blocks() const override { return rows_->num_blocks(); }
  std::size_t more_blocks() const override { return rows_->more_blocks(); }
  std::size_t more_tiles() const override { return rows_->more_tiles(); }
  const Chunks& reduced_chunks() const override { return solved_chunks_; }
  std::size_t scratch() const override { return rows_->scratch(); }
  bool keeps_metric() const override { return rows_->keeps_metric(); }
  void attach(const SteppedState& state) override;
  const double* held_cameras() const override { return rows_->held_cameras(); }
  CoarseSpace::State coarse_state() override;
  const BlockMap* map() const override { return &map_; }
  void begin(const StepRequest& request) override { rows_->begin(request); }
  Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch, double* tiles,
                    double* diagonal, EliminateOutput& out) override {
    return rows_->eliminate(in, chunk, scratch, tiles, diagonal, out);
  }
  Costs held_costs(const Costs& summed) const override { return rows_->held_costs(summed); }
  ReducedSums finish(double* tiles, double* diagonal) override;
  void step(const Buffer<double>& columns) override;
  void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) override {
    rows_->trial(in, chunk, out);
  }
  Costs tried_costs(const PointTrial& in, const Costs& summed, Settling& points,
                    Trial& out) override {
    return rows_->tried_costs(in, summed, points, out);
  }
  void accepted() override;
  double residual_scale(double quantile) const override { return rows_->residual_scale(quantile); }
  double pixel_rms() const override { return rows_->pixel_rms(); }
  std::uint64_t count_behind() const override { return rows_->count_behind(); }
  Operators make_operators(const Columns& columns, bool mixed) override;
  std::unique_ptr<DoglegSource> make_dogleg() override;
  std::uint64_t bytes() const override;

 private:
  class Operator;
  class Dogleg;

  const std::unique_ptr<PointRows> rows_;
  const Columns& columns_;
  const BlockMap& map_;
  BlockFold fold_;
  Chunks solved_chunks_;
  const SteppedState* state_ = nullptr;
  Adjoints adjoints_;  ///< of the held state
  const double* row_diagonal_ = nullptr;
  Buffer<double> solved_, of_rows_, row_columns_;
  Buffer<double> records_;  ///< kCameraRecord per solved block: poses of images and frames
};

}  // namespace sheaf
