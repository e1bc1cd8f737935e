// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/point_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lists/slices.h"
#include "platform/cancel.h"

namespace sheaf {
namespace {

constexpr std::size_t kGroupsPerTask = 1024;
/// Of the units that the linear system's products with points are computed in.
constexpr double kRounding = 1.1e-16, kFloatRounding = 6e-8;

}  // namespace

std::unique_ptr<DoglegSource> PointRows::make_dogleg() { return {}; }

PointSystem::PointSystem(std::unique_ptr<PointRows> rows, Start start, const Numbering& columns,
                         const PointRules& rules, const Plan& plan, const Kernels& kernels,
                         Threads& threads)
    : rows_(std::move(rows)),
      columns_(*columns.columns),
      camera_columns_(std::move(start.camera_columns)),
      rules_(rules),
      float_products_(plan.mixed && plan.kind == SolverKind::implicit_cg),
      float_blocks_(plan.mixed && plan.kind == SolverKind::explicit_cg),
      threads_(threads),
      stage_(columns_) {
  state_.held.cameras = std::move(start.cameras);
  state_.tried.cameras = state_.held.cameras;
  fill_points(*start.points);
  rows_->attach(state_);
  place_charts();
  state_.factors.allocate(kFactorGroup * rows_->batches().groups.size());
  const auto room = [this](std::size_t of_rows, std::size_t more) {
    return std::max(num_slices() * of_rows, of_rows + more);
  };
  tiles_.allocate(kTileDoubles * room(rows_->chunks().tiles.size(), rows_->more_tiles()));
  diagonal_.allocate(kDiagonalDoubles * room(rows_->num_blocks(), rows_->more_blocks()));
  scratch_.resize(static_cast<std::size_t>(threads.count()));
  eliminated_.resize(num_slices());
  trials_.resize(num_slices());
  set_solver(plan, columns, kernels);
}

void PointSystem::set_solver(const Plan& plan, const Numbering& columns, const Kernels& kernels) {
  const bool iterates =
      plan.kind == SolverKind::explicit_cg || plan.kind == SolverKind::implicit_cg;
  if (iterates && !rules_.held && plan.clusters.count > 0)
    stage_.set_coarse(std::make_unique<CoarseSpace>(rows_->batches(), *columns.coarse, rows_->map(),
                                                    plan.clusters, num_slices(), kernels,
                                                    threads_));
  const Chunks& chunks = rows_->reduced_chunks();
  switch (plan.kind) {
    case SolverKind::blocks:
      return stage_.set_solver(make_block_solver(columns_, threads_));
    case SolverKind::dense:
      return stage_.set_solver(make_dense_solver(columns_, kernels, threads_));
    case SolverKind::sparse:
      return stage_.set_solver(
          make_sparse_solver(columns_, chunks, kernels, threads_, plan.analysis));
    case SolverKind::explicit_cg:
      return stage_.set_solver(
          make_explicit_solver(columns_, chunks, plan.mixed, kernels, threads_));
    case SolverKind::implicit_cg: {
      PointRows::Operators products = rows_->make_operators(columns_, plan.mixed);
      return stage_.set_solver(make_implicit_solver(columns_, std::move(products.exact),
                                                    std::move(products.rounded), threads_));
    }
  }
}

void PointSystem::fill_points(const std::vector<double>& points) {
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

/// Homogeneous points are about the frame of the scene. Points that are held have no charts:
/// nothing of them may move.
void PointSystem::place_charts() {
  if (rules_.held || rules_.charts == ChartBase::none) return;
  const SceneFrame frame = scene_frame(state_.held.cameras);
  chart_.base = rules_.charts;
  chart_.crosses = rules_.crosses;
  chart_.origin = frame.origin;
  chart_.unit = frame.unit;
}

Step PointSystem::propose(const StepRequest& request) {
  const bool reuse = only_radius_is_new(request);
  request_ = request;
  if (reuse) {
    step_.reused = true;
    step_.linear_iterations = 0;
    if (stage_.shorten(sums_, request_)) plane_.reset();
    return step_;
  }
  plane_.reset();
  proposed_ = descended_ = false;
  step_ = linearize(request);
  proposed_ = step_.solved;
  return step_;
}

Step PointSystem::linearize(const StepRequest& request) {
  rows_->begin(request);
  loss_ = request.loss;
  loss_.weighted = rows_->batches().weighted();
  allocate_for_loss();
  chart_.rounding = 1e2 * (float_products_ && !request.precise ? kFloatRounding : kRounding);
  eliminate(request);
  add_slices(tiles_, num_slices(), threads_);
  add_slices(diagonal_, num_slices(), threads_);
  sums_ = rows_->finish(tiles_.data(), diagonal_.data());
  return collect_step(request);
}

void PointSystem::allocate_for_loss() {
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

void PointSystem::eliminate(const StepRequest& request) {
  const Chunks& chunks = rows_->chunks();
  const std::size_t tile_doubles = kTileDoubles * chunks.tiles.size();
  const std::size_t diagonal_doubles = kDiagonalDoubles * rows_->num_blocks();
  const Elimination in{request.damping, rules_.held, loss_, chart_,
                       state_.own_damping.size() > 0 ? state_.own_damping.data() : nullptr};
  CoarseSpace* const coarse = stage_.coarse();
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

Step PointSystem::collect_step(const StepRequest& request) {
  double square_sum = 0, loss_sum = 0, gradient2 = 0;
  point_decrease_ = 0;
  for (const EliminateOutput& out : eliminated_) {
    square_sum += out.square_sum;
    loss_sum += out.loss_sum;
    point_decrease_ += out.point_decrease;
    gradient2 = std::max(gradient2, out.gradient_max2);
  }
  double totals[] = {square_sum, loss_sum, point_decrease_};
  reduction_.sum(totals, 3);
  reduction_.max(&gradient2, 1);
  point_decrease_ = totals[2];
  const Costs costs = rows_->held_costs(Costs::of(loss_, totals[0], totals[1]));
  Step step;
  step.plain_cost = costs.square / 2;
  step.cost = costs.robust / 2;
  mean_square_ = 2 * step.cost / static_cast<double>(rows_->batches().observations);
  // w is whitened by V (1 + damping): undo the damping's part.
  step.gradient_max = std::max(
      std::sqrt(gradient2 * (1 + request.damping)),
      stage_.gather(sums_, request.damping, camera_columns_.step_bounds(state_.held.cameras)));
  step.solved = costs.finite() && stage_.solve(sums_, request, step);
  return step;
}

PointTrial PointSystem::point_trial(const DoglegStep& step) const {
  PointTrial out{rules_.watch_behind,
                 rules_.held ? 0 : rules_.inner_iterations,
                 mean_square_,
                 loss_,
                 chart_,
                 {},
                 {}};
  out.own.held_costs = state_.point_costs.data();
  out.own.damping = request_.damping;
  out.own.worth = std::max(inner_iterations::kLeastWorth,
                           std::min(inner_iterations::kWorthOne,
                                    inner_iterations::kWorthOfLast * request_.last_decrease));
  if (rules_.held) return out;
  out.blend.newton = step.newton;
  if (plane_) {
    out.blend.descent = step.descent * request_.damping;
    out.blend.inner_damping *= std::max(1.0, damping_of(*plane_, step) / request_.damping);
  }
  return out;
}

/// The records keep the step that was solved for: points follow it by back-substitution.
Trial PointSystem::try_step(const DoglegStep& step) {
  Trial out;
  out.step_norm =
      camera_columns_.step(state_.held.cameras, blend_cameras(step), state_.tried.cameras);
  rows_->step(stage_.step());
  const PointTrial in = point_trial(step);
  const Chunks& chunks = rows_->chunks();
  threads_.for_each(num_slices(), [&](std::size_t s) {
    poll_cancelled();
    trials_[s] = {state_.tried.points.data(), 0, 0, 0, 0, 0, 0, state_.own_damping.data()};
    for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c)
      rows_->trial(in, c, trials_[s]);
  });
  // The decrease goes on from the points' part of the elimination.
  double decrease = point_decrease_, square_sum = 0, loss_sum = 0, step2 = 0;
  newton_damping_ = left_decrease_ = 0;
  for (const TrialOutput& o : trials_) {
    left_decrease_ += o.left_decrease;
    square_sum += o.square_sum;
    loss_sum += o.loss_sum;
    decrease += o.damping_term;
    newton_damping_ += o.damping_term;
    step2 = std::max(step2, o.step2_max);
    out.newly_behind += o.newly_behind;
  }
  Settling settling{state_.tried.points.data(),
                    state_.own_damping.size() > 0 ? state_.own_damping.data() : nullptr,
                    left_decrease_};
  const Costs costs = rows_->tried_costs(in, Costs::of(loss_, square_sum, loss_sum), settling, out);
  left_decrease_ = settling.left_decrease;
  out.plain_cost = costs.square / 2;
  out.cost = trial_cost_ = costs.robust / 2;
  out.predicted_decrease = less_what_was_left(stage_.add_decrease(decrease) / 2);
  out.step_norm = std::max(out.step_norm, std::sqrt(step2));
  return out;
}

void PointSystem::accept() {
  stage_.moved(trial_cost_);
  std::swap(state_.held, state_.tried);
  rows_->accepted();
  proposed_ = false;
}

/// Points that did not follow their step brought nothing of what it promised.
double PointSystem::less_what_was_left(double predicted) const {
  if (left_decrease_ <= 0) return predicted;
  return std::max(predicted - left_decrease_ / 2, 1e-3 * predicted);
}

HomeHistory PointSystem::history() const {
  const Buffer<double>& own = state_.own_damping;
  return {stage_.history(), {own.data(), own.data() + own.size()}};
}

bool PointSystem::restore(const HomeHistory& history) {
  const std::size_t own = history.own_damping.size();
  if (own != 0 && own != 8 * rows_->batches().groups.size()) return false;
  if (!stage_.restore(history.stage)) return false;
  state_.own_damping.allocate(history.own_damping.size());
  std::copy(history.own_damping.begin(), history.own_damping.end(), state_.own_damping.data());
  return true;
}

/// All that a step reads of the steps before is put back to what the constructor leaves: the state,
/// the points' own damping, what the camera solver has learnt. A coarse space is not, which has a
/// schedule of its own, nor blocks of floats that have been given up for doubles.
bool PointSystem::restart(const CameraState& cameras, const std::vector<double>& points) {
  if (stage_.coarse() != nullptr || float_blocks_) return false;
  allocate_scratch();
  state_.held.cameras = cameras;
  state_.tried.cameras = cameras;
  fill_points(points);
  rows_->attach(state_);
  place_charts();
  state_.own_damping.fill(0);
  plane_.reset();
  proposed_ = descended_ = false;
  return stage_.restore({});
}

/// Which thread takes its first slice when is nobody's to say: whoever begins again has all of it.
void PointSystem::allocate_scratch() {
  for (Buffer<double>& scratch : scratch_)
    if (scratch.size() == 0) scratch.allocate(rows_->scratch());
}

double PointSystem::residual_scale(double quantile) { return rows_->residual_scale(quantile); }

void PointSystem::store_points(std::vector<double>& points) const {
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

std::uint64_t PointSystem::bytes() const {
  std::uint64_t sum = state_.held.points.bytes() + state_.tried.points.bytes() +
                      state_.factors.bytes() + state_.metric.bytes() + state_.point_costs.bytes() +
                      state_.own_damping.bytes() + tiles_.bytes() + diagonal_.bytes() +
                      scratch_.size() * 8 * rows_->scratch();
  if (passes_) sum += passes_->bytes();
  return sum + rows_->bytes() + stage_.bytes();
}

}  // namespace sheaf
