// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "systems/point_rows.h"
#include "systems/term.h"

namespace sheaf {

/// Rows, and beside them terms: rows that have no point to eliminate. Terms add to the diagonal
/// blocks and tiles that elimination leaves, to costs and to products; the blocks of kept points
/// follow those of the rows. MappedRows stands between these and what is solved for.
class TermRows : public PointRows {
 public:
  /// row_columns: of the rows' blocks alone; kept: how many blocks of kept points follow.
  TermRows(std::unique_ptr<PointRows> rows, std::vector<std::unique_ptr<Term>> terms,
           const Columns& row_columns, std::size_t kept);
  ~TermRows() override;

  const Batches& batches() const override { return rows_->batches(); }
  const Chunks& chunks() const override { return rows_->chunks(); }
  std::size_t num_blocks() const override { return rows_->num_blocks(); }
  std::size_t more_blocks() const override { return kept_; }
  std::size_t more_tiles() const override {
    return with_tiles_.tiles.size() - rows_->chunks().tiles.size();
  }
  const Chunks& reduced_chunks() const override { return with_tiles_; }
  std::size_t scratch() const override { return rows_->scratch(); }
  bool keeps_metric() const override { return rows_->keeps_metric(); }
  void attach(const SteppedState& state) override;
  const double* held_cameras() const override { return rows_->held_cameras(); }
  void begin(const StepRequest& request) override;
  Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch, double* tiles,
                    double* diagonal, EliminateOutput& out) override {
    return rows_->eliminate(in, chunk, scratch, tiles, diagonal, out);
  }
  Costs held_costs(const Costs& summed) const override;
  ReducedSums finish(double* tiles, double* diagonal) override;
  void step(const Buffer<double>& columns) override { rows_->step(columns); }
  void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) override {
    rows_->trial(in, chunk, out);
  }
  Costs tried_costs(const PointTrial& in, const Costs& summed, Settling& points,
                    Trial& out) override;
  void accepted() override { rows_->accepted(); }
  double residual_scale(double quantile) const override { return rows_->residual_scale(quantile); }
  /// Observations of kept points are terms.
  double pixel_rms() const override { return kept_ > 0 ? -1 : rows_->pixel_rms(); }
  std::uint64_t count_behind() const override { return rows_->count_behind(); }
  Operators make_operators(const Columns& columns, bool mixed) override;
  std::unique_ptr<DoglegSource> make_dogleg() override;
  std::uint64_t bytes() const override;

 private:
  class Operator;
  class Dogleg;
  /// A term at the held state: the loss's rows N J and the residual that stands for it.
  struct Linear {
    std::vector<double> J, r;
  };

  void linearize();
  Costs add_costs(const CameraState& at, const Costs& of_rows, const ScaledLoss& loss) const;
  void add_to_sums(const Term& term, const Linear& of, const Couplings& couplings,
                   double* more_tiles, double* diagonal);
  /// y += (N J)^T N J x, block vectors.
  void multiply(const double* x, double* y) const;

  const std::unique_ptr<PointRows> rows_;
  const std::vector<std::unique_ptr<Term>> terms_;
  const Columns& row_columns_;
  const std::size_t kept_;
  Chunks with_tiles_;  ///< tiles alone: those of the rows, then the terms'
  const SteppedState* state_ = nullptr;
  ScaledLoss loss_;
  std::vector<Linear> linear_;
  std::vector<double> products_;  ///< of a term's columns
};

}  // namespace sheaf
