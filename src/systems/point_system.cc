// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/point_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sheaf {
namespace {

/// Of the units that the linear system's products with points are computed in.
constexpr double kRounding = 1.1e-16, kFloatRounding = 6e-8;

}  // namespace

PointSystem::PointSystem(std::unique_ptr<PointRows> rows, Start start, const Numbering& columns,
                         const PointRules& rules, const Plan& plan, const Kernels& kernels,
                         Threads& threads)
    : piece_(std::move(rows), std::move(start.cameras), *start.points, rules, threads),
      columns_(*columns.columns),
      camera_columns_(std::move(start.camera_columns)),
      float_products_(plan.mixed && plan.kind == SolverKind::implicit_cg),
      float_blocks_(plan.mixed && plan.kind == SolverKind::explicit_cg),
      threads_(threads),
      stage_(columns_) {
  piece_.place_charts(scene_frame(cameras()));
  set_solver(plan, columns, kernels);
}

void PointSystem::set_solver(const Plan& plan, const Numbering& columns, const Kernels& kernels) {
  const bool iterates =
      plan.kind == SolverKind::explicit_cg || plan.kind == SolverKind::implicit_cg;
  if (iterates && !piece_.rules().held && plan.clusters.count > 0)
    stage_.set_coarse(std::make_unique<CoarseSpace>(rows().batches(), *columns.coarse, rows().map(),
                                                    plan.clusters, piece_.num_slices(), kernels,
                                                    threads_));
  const Chunks& chunks = rows().reduced_chunks();
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
      PointRows::Operators products = rows().make_operators(columns_, plan.mixed);
      return stage_.set_solver(make_implicit_solver(columns_, std::move(products.exact),
                                                    std::move(products.rounded), threads_));
    }
  }
}

Step PointSystem::propose(const StepRequest& request) {
  const bool reuse = only_radius_is_new(request);
  request_ = request;
  if (reuse) {
    step_.reused = true;
    step_.linear_iterations = 0;
    if (stage_.shorten(piece_.sums(), request_)) plane_.reset();
    return step_;
  }
  plane_.reset();
  proposed_ = descended_ = false;
  step_ = linearize(request);
  proposed_ = step_.solved;
  return step_;
}

Step PointSystem::linearize(const StepRequest& request) {
  loss_ = request.loss;
  loss_.weighted = rows().batches().weighted();
  const double rounding = 1e2 * (float_products_ && !request.precise ? kFloatRounding : kRounding);
  return collect_step(request, piece_.eliminate(request, loss_, rounding, stage_.coarse()));
}

Step PointSystem::collect_step(const StepRequest& request,
                               const PointPiece::Eliminated& eliminated) {
  double totals[] = {eliminated.square_sum, eliminated.loss_sum, eliminated.point_decrease};
  double gradient2 = eliminated.gradient2;
  reduction_.sum(totals, 3);
  reduction_.max(&gradient2, 1);
  point_decrease_ = totals[2];
  const Costs costs = rows().held_costs(Costs::of(loss_, totals[0], totals[1]));
  Step step;
  step.plain_cost = costs.square / 2;
  step.cost = costs.robust / 2;
  mean_square_ = 2 * step.cost / static_cast<double>(rows().batches().observations);
  // w is whitened by V (1 + damping): undo the damping's part.
  step.gradient_max = std::max(
      std::sqrt(gradient2 * (1 + request.damping)),
      stage_.gather(piece_.sums(), request.damping, camera_columns_.step_bounds(cameras())));
  step.solved = costs.finite() && stage_.solve(piece_.sums(), request, step);
  return step;
}

PointTrial PointSystem::point_trial(const DoglegStep& step) const {
  PointTrial out = piece_.trial_rules(request_, mean_square_);
  if (piece_.rules().held) return out;
  out.blend.newton = step.newton;
  if (plane_) {
    out.blend.descent = step.descent * request_.damping;
    out.blend.inner_damping *= std::max(1.0, damping_of(*plane_, step) / request_.damping);
  }
  return out;
}

Trial PointSystem::try_step(const DoglegStep& step) {
  Trial out;
  SteppedState& state = piece_.state();
  out.step_norm =
      camera_columns_.step(state.held.cameras, blend_cameras(step), state.tried.cameras);
  const PointTrial in = point_trial(step);
  const PointPiece::Tried tried = piece_.follow(stage_.step(), in);
  newton_damping_ = tried.damping_term;
  left_decrease_ = tried.left_decrease;
  out.newly_behind = tried.newly_behind;
  Settling settling{state.tried.points.data(),
                    state.own_damping.size() > 0 ? state.own_damping.data() : nullptr,
                    left_decrease_};
  const Costs costs =
      rows().tried_costs(in, Costs::of(loss_, tried.square_sum, tried.loss_sum), settling, out);
  left_decrease_ = settling.left_decrease;
  out.plain_cost = costs.square / 2;
  out.cost = trial_cost_ = costs.robust / 2;
  // The decrease goes on from the points' part of the elimination.
  const double decrease = piece_.add_damping_terms(point_decrease_);
  out.predicted_decrease = less_what_was_left(stage_.add_decrease(decrease) / 2);
  out.step_norm = std::max(out.step_norm, std::sqrt(tried.step2));
  return out;
}

void PointSystem::accept() {
  stage_.moved(trial_cost_);
  piece_.accept();
  proposed_ = false;
}

/// Points that did not follow their step brought nothing of what it promised.
double PointSystem::less_what_was_left(double predicted) const {
  if (left_decrease_ <= 0) return predicted;
  return std::max(predicted - left_decrease_ / 2, 1e-3 * predicted);
}

HomeHistory PointSystem::history() const {
  const Buffer<double>& own = piece_.state().own_damping;
  return {stage_.history(), {own.data(), own.data() + own.size()}};
}

bool PointSystem::restore(const HomeHistory& history) {
  const std::size_t own = history.own_damping.size();
  if (own != 0 && own != 8 * rows().batches().groups.size()) return false;
  if (!stage_.restore(history.stage)) return false;
  Buffer<double>& to = piece_.state().own_damping;
  to.allocate(own);
  std::copy(history.own_damping.begin(), history.own_damping.end(), to.data());
  return true;
}

/// All that a step reads of the steps before is put back to what the constructor leaves: the state,
/// the points' own damping, what the camera solver has learnt. A coarse space is not, which has a
/// schedule of its own, nor blocks of floats that have been given up for doubles.
bool PointSystem::restart(const CameraState& cameras, const std::vector<double>& points) {
  if (stage_.coarse() != nullptr || float_blocks_) return false;
  piece_.restart(cameras, points);
  piece_.place_charts(scene_frame(cameras));
  plane_.reset();
  proposed_ = descended_ = false;
  return stage_.restore({});
}

double PointSystem::residual_scale(double quantile) { return rows().residual_scale(quantile); }

std::uint64_t PointSystem::bytes() const {
  return piece_.bytes() + (passes_ ? passes_->bytes() : 0) + stage_.bytes();
}

}  // namespace sheaf
