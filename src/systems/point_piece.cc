// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/point_piece.h"

#include <algorithm>
#include <utility>

#include "lists/slices.h"
#include "platform/cancel.h"
#include "systems/dogleg_passes.h"

namespace sheaf {
namespace {

constexpr std::size_t kGroupsPerTask = 1024;

}  // namespace

std::unique_ptr<DoglegSource> PointRows::make_dogleg() { return {}; }

PointPiece::PointPiece(std::unique_ptr<PointRows> rows, CameraState cameras,
                       const std::vector<double>& points, const PointRules& rules, Threads& threads)
    : rows_(std::move(rows)), rules_(rules), threads_(threads) {
  state_.held.cameras = std::move(cameras);
  state_.tried.cameras = state_.held.cameras;
  fill_points(points);
  rows_->attach(state_);
  state_.factors.allocate(kFactorGroup * rows_->batches().groups.size());
  const auto room = [this](std::size_t of_rows, std::size_t more) {
    return std::max(num_slices() * of_rows, of_rows + more);
  };
  tiles_.allocate(kTileDoubles * room(rows_->chunks().tiles.size(), rows_->more_tiles()));
  diagonal_.allocate(kDiagonalDoubles * room(rows_->num_blocks(), rows_->more_blocks()));
  scratch_.resize(static_cast<std::size_t>(threads.count()));
  eliminated_.resize(num_slices());
  trials_.resize(num_slices());
}

void PointPiece::fill_points(const std::vector<double>& points) {
  const Batches& batches = rows_->batches();
  PointState &held = state_.held, &tried = state_.tried;
  for (PointState* state : {&held, &tried})
    if (state->points.size() == 0) state->points.allocate(kPointGroup * batches.groups.size());
  threads_.for_ranges(batches.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (std::size_t l = 0; l < 8; ++l) {
        const double* X = &points[3 * std::size_t(batches.lane_point[8 * g + l])];
        for (std::size_t d = 0; d < 3; ++d) held.points[kPointGroup * g + 8 * d + l] = X[d];
      }
  });
}

/// Points that are held have no charts: nothing of them may move.
void PointPiece::place_charts(const SceneFrame& frame) {
  if (rules_.held || rules_.charts == ChartBase::none) return;
  chart_.base = rules_.charts;
  chart_.crosses = rules_.crosses;
  chart_.origin = frame.origin;
  chart_.unit = frame.unit;
}

PointPiece::Eliminated PointPiece::eliminate(const StepRequest& request, const ScaledLoss& loss,
                                             double rounding, CoarseSpace* coarse) {
  rows_->begin(request);
  loss_ = loss;
  allocate_for_loss();
  chart_.rounding = rounding;
  pass(request, coarse);
  add_slices(tiles_, num_slices(), threads_);
  add_slices(diagonal_, num_slices(), threads_);
  sums_ = rows_->finish(tiles_.data(), diagonal_.data());
  Eliminated out;
  for (const EliminateOutput& slice : eliminated_) {
    out.square_sum += slice.square_sum;
    out.loss_sum += slice.loss_sum;
    out.point_decrease += slice.point_decrease;
    out.gradient2 = std::max(out.gradient2, slice.gradient_max2);
  }
  return out;
}

void PointPiece::allocate_for_loss() {
  const bool robust = loss_.weighs();
  const Batches& batches = rows_->batches();
  const std::size_t metric =
      robust && rows_->keeps_metric() ? kMetricBatch * batches.num_batches() : 0;
  if (state_.metric.size() != metric) state_.metric.allocate(metric);
  const std::size_t own = robust ? 8 * batches.groups.size() : 0;
  const std::size_t costs = rows_->keeps_metric() ? own : 0;
  if (state_.point_costs.size() != costs) state_.point_costs.allocate(costs);
  if (state_.own_damping.size() == own) return;
  state_.own_damping.allocate(own);
  state_.own_damping.fill(0);
}

void PointPiece::pass(const StepRequest& request, CoarseSpace* coarse) {
  const Chunks& chunks = rows_->chunks();
  const std::size_t tile_doubles = kTileDoubles * chunks.tiles.size();
  const std::size_t diagonal_doubles = kDiagonalDoubles * rows_->num_blocks();
  const Elimination in{request.damping, rules_.held, loss_, chart_,
                       state_.own_damping.size() > 0 ? state_.own_damping.data() : nullptr};
  if (coarse != nullptr) coarse->begin(rows_->coarse_state(), request.damping);
  threads_.for_each(num_slices(), [&](std::size_t s) {
    poll_cancelled();
    Buffer<double>& scratch = scratch_[static_cast<std::size_t>(threads_.worker())];
    if (scratch.size() == 0) scratch.allocate(rows_->scratch());
    double* tiles = tiles_.data() + s * tile_doubles;
    double* diagonal = diagonal_.data() + s * diagonal_doubles;
    std::fill_n(tiles, tile_doubles, 0.0);
    std::fill_n(diagonal, diagonal_doubles, 0.0);
    if (coarse != nullptr) coarse->clear(s);
    EliminateOutput& out = eliminated_[s];
    out = {state_.factors.data(), 0, 0, 0, 0, state_.metric.data(), state_.point_costs.data()};
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c) {
      const Records records = rows_->eliminate(in, c, scratch.data(), tiles, diagonal, out);
      if (coarse != nullptr) coarse->add(s, chunks.chunks[c], records);
    }
  });
}

PointTrial PointPiece::trial_rules(const StepRequest& request, double mean_square) const {
  PointTrial out{rules_.watch_behind,
                 rules_.held ? 0 : rules_.inner_iterations,
                 mean_square,
                 loss_,
                 chart_,
                 {},
                 {}};
  out.own.held_costs = state_.point_costs.data();
  out.own.damping = request.damping;
  out.own.worth = std::max(inner_iterations::kLeastWorth,
                           std::min(inner_iterations::kWorthOne,
                                    inner_iterations::kWorthOfLast * request.last_decrease));
  return out;
}

/// The records keep the step that was solved for: points follow it by back-substitution.
PointPiece::Tried PointPiece::follow(const Buffer<double>& step, const PointTrial& rules) {
  rows_->step(step);
  const Chunks& chunks = rows_->chunks();
  threads_.for_each(num_slices(), [&](std::size_t s) {
    poll_cancelled();
    trials_[s] = {state_.tried.points.data(), 0, 0, 0, 0, 0, 0, state_.own_damping.data()};
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c)
      rows_->trial(rules, c, trials_[s]);
  });
  Tried out;
  for (const TrialOutput& slice : trials_) {
    out.left_decrease += slice.left_decrease;
    out.square_sum += slice.square_sum;
    out.loss_sum += slice.loss_sum;
    out.damping_term += slice.damping_term;
    out.step2 = std::max(out.step2, slice.step2_max);
    out.newly_behind += slice.newly_behind;
  }
  return out;
}

double PointPiece::add_damping_terms(double sum) const {
  for (const TrialOutput& slice : trials_) sum += slice.damping_term;
  return sum;
}

void PointPiece::accept() {
  std::swap(state_.held, state_.tried);
  rows_->accepted();
}

/// Which thread takes its first slice when is nobody's to say: whoever begins again has all of its
/// scratch.
void PointPiece::restart(const CameraState& cameras, const std::vector<double>& points) {
  for (Buffer<double>& scratch : scratch_)
    if (scratch.size() == 0) scratch.allocate(rows_->scratch());
  state_.held.cameras = cameras;
  state_.tried.cameras = cameras;
  fill_points(points);
  rows_->attach(state_);
  state_.own_damping.fill(0);
}

void PointPiece::store_points(std::vector<double>& points) const {
  const Batches& batches = rows_->batches();
  const Buffer<double>& held = state_.held.points;
  threads_.for_ranges(batches.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l) {
        double* X = &points[3 * std::size_t(batches.lane_point[8 * g + l])];
        for (std::size_t d = 0; d < 3; ++d) X[d] = held[kPointGroup * g + 8 * d + l];
      }
  });
}

std::uint64_t PointPiece::bytes() const {
  return state_.held.points.bytes() + state_.tried.points.bytes() + state_.factors.bytes() +
         state_.metric.bytes() + state_.point_costs.bytes() + state_.own_damping.bytes() +
         tiles_.bytes() + diagonal_.bytes() + scratch_.size() * 8 * rows_->scratch() +
         rows_->bytes();
}

}  // namespace sheaf
