// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/distributed_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reduced/scaling.h"

namespace sheaf {
namespace {

constexpr int kWidth = RankPiece::kWidth, kSums = RankPiece::kSums;
constexpr double kRounding = 1.1e-16, kFloatRounding = 6e-8;

}  // namespace

Step DistributedSystem::propose(const StepRequest& request) {
  request_ = request;
  loss_ = request.loss;
  Step step;
  std::vector<double> mine;
  double gradient2 = 0;
  const double rounding = 1e2 * (floats_ && !request.precise ? kFloatRounding : kRounding);
  for (auto& piece : pieces_) {
    PointPiece& points = piece->points();
    ScaledLoss loss = request.loss;
    loss.weighted = points.rows().batches().weighted();
    const PointPiece::Eliminated out = points.eliminate(request, loss, rounding, nullptr);
    const Costs costs = points.rows().held_costs(Costs::of(loss, out.square_sum, out.loss_sum));
    mine.insert(mine.end(), {costs.square, costs.robust, out.point_decrease});
    gradient2 = std::max(gradient2, out.gradient2);
  }
  const std::vector<double> totals = ranks_.sum(3, mine);
  step.plain_cost = totals[0] / 2;
  step.cost = totals[1] / 2;
  point_decrease_ = totals[2];
  mean_square_ = 2 * step.cost / static_cast<double>(observations_);
  add_shares_of_sums();
  const double gradient = gather();
  step.gradient_max = std::max(std::sqrt(ranks_.max(gradient2) * (1 + request.damping)), gradient);
  step.solved = std::isfinite(totals[0]) && std::isfinite(totals[1]) && solve(request, step);
  return step;
}

/// Owners get the diagonal blocks, right-hand sides and squares that other pieces' points gave.
void DistributedSystem::add_shares_of_sums() {
  std::vector<double> owned(exchange_->owned() * kSums), ghosts(exchange_->ghosts() * kSums);
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const double* from = pieces_[p]->points().sums().diagonal;
    double *to = &owned[kSums * exchange_->first_owned(p)],
           *shares = ghosts.data() + kSums * exchange_->first_ghost(p);
    pieces_[p]->for_each(
        [&](std::size_t k, std::uint32_t b) {
          std::copy_n(from + kSums * b, kSums, to + kSums * k);
        },
        [&](std::size_t k, std::uint32_t b) {
          std::copy_n(from + kSums * b, kSums, shares + kSums * k);
        });
  }
  exchange_->add_shares(kSums, ghosts.data(), owned.data());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const double* from = pieces_[p]->points().sums().diagonal;
    sums_[p].assign(from, from + kSums * pieces_[p]->num_blocks());
    const double* full = owned.data() + kSums * exchange_->first_owned(p);
    pieces_[p]->for_each_owned([&](std::size_t k, std::uint32_t b) {
      std::copy_n(full + kSums * k, kSums, &sums_[p][kSums * b]);
    });
  }
}

/// Right-hand side and damping; the largest scaled gradient of all ranks.
double DistributedSystem::gather() {
  double gradient = 0;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    RankPiece& piece = *pieces_[p];
    const Columns& columns = piece.columns();
    vectors_[p].gather({&piece.points().rows().chunks(), nullptr, sums_[p].data()}, columns);
    for (std::size_t c = 0; c < static_cast<std::size_t>(columns.count); ++c)
      damping_[p][c] =
          request_.damping * std::clamp(vectors_[p].squares[c], kDiagonalFloor, kDiagonalCeiling);
    const std::size_t first = kWidth * exchange_->first_owned(p);
    piece.for_each_owned([&](std::size_t k, std::uint32_t b) {
      for (std::size_t j = 0; j < kWidth; ++j) {
        const std::int32_t c = columns.image(b)[j];
        const std::size_t at = first + kWidth * k + j;
        rhs_[at] = c >= 0 ? vectors_[p].rhs[static_cast<std::size_t>(c)] : 0;
        owned_damping_[at] = c >= 0 ? damping_[p][static_cast<std::size_t>(c)] : 0;
        if (c < 0) continue;
        const double square = owned_damping_[at] / request_.damping;
        gradient = std::max(gradient, std::abs(rhs_[at]) / std::sqrt(square));
      }
    });
  }
  return ranks_.max(gradient);
}

bool DistributedSystem::solve(const StepRequest& request, Step& step) {
  bool factored = true;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    pieces_[p]->prepare(request.precise, vectors_[p].squares.data());
    factored = pieces_[p]->diagonal().factor(sums_[p].data(), damping_[p].data()) && factored;
  }
  if (ranks_.any(!factored)) return false;
  std::function<bool()> cancelled;
  if (request.cancelled != nullptr && *request.cancelled)
    cancelled = [&] { return ranks_.any((*request.cancelled)()); };
  const Krylov::Solution solution =
      krylov_->solve(rhs_.data(), request.forcing, cancelled, step_.data());
  step.linear_iterations = solution.iterations;
  return solution.solved;
}

void DistributedSystem::multiply(const double* x, double* y) {
  exchange_->to_ghosts(kWidth, x, ghosts_.data());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const std::size_t owned = kWidth * exchange_->first_owned(p),
                      ghosts = kWidth * exchange_->first_ghost(p);
    pieces_[p]->multiply(x + owned, ghosts_.data() + ghosts, y + owned, shares_.data() + ghosts);
  }
  exchange_->add_shares(kWidth, shares_.data(), y);
  for (std::size_t i = 0; i < rhs_.size(); ++i) y[i] += owned_damping_[i] * x[i];
}

void DistributedSystem::precondition(const double* r, double* z) {
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const std::size_t first = kWidth * exchange_->first_owned(p);
    pieces_[p]->precondition(r + first, z + first);
  }
}

/// Every piece steps what it has, ghosts too: the same numbers everywhere.
double DistributedSystem::step_cameras(double stretch) {
  double norm = 0;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    pieces_[p]->to_columns(step_.data() + kWidth * exchange_->first_owned(p),
                           ghosts_.data() + kWidth * exchange_->first_ghost(p), columns_[p]);
    for (std::size_t c = 0; c < columns_[p].size(); ++c) out_[p][c] = stretch * columns_[p][c];
    norm = std::max(norm, pieces_[p]->step_cameras(out_[p]));
  }
  return norm;
}

Trial DistributedSystem::trial() {
  exchange_->to_ghosts(kWidth, step_.data(), ghosts_.data());
  double norm = step_cameras(request_.stretch);
  std::vector<double> mine;
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    PointPiece& points = pieces_[p]->points();
    ScaledLoss loss = loss_;
    loss.weighted = points.rows().batches().weighted();
    PointTrial rules = points.trial_rules(request_, mean_square_);
    if (!points.rules().held) rules.blend.newton = request_.stretch;
    const PointPiece::Tried tried = points.follow(columns_[p], rules);
    Trial local;
    local.newly_behind = tried.newly_behind;
    Settling settling{
        points.state().tried.points.data(),
        points.state().own_damping.size() > 0 ? points.state().own_damping.data() : nullptr,
        tried.left_decrease};
    const Costs costs = points.rows().tried_costs(
        rules, Costs::of(loss, tried.square_sum, tried.loss_sum), settling, local);
    double promised = tried.damping_term;
    const std::size_t begin = kWidth * exchange_->first_owned(p),
                      end = begin + kWidth * pieces_[p]->num_owned();
    for (std::size_t i = begin; i < end; ++i)
      promised += step_[i] * (rhs_[i] + owned_damping_[i] * step_[i]);
    mine.insert(mine.end(), {costs.square, costs.robust, promised, settling.left_decrease,
                             static_cast<double>(local.newly_behind)});
    norm = std::max(norm, std::sqrt(tried.step2));
  }
  const std::vector<double> totals = ranks_.sum(5, mine);
  Trial out;
  out.plain_cost = totals[0] / 2;
  out.cost = totals[1] / 2;
  out.predicted_decrease = (point_decrease_ + totals[2]) / 2;
  // Points that did not follow their step brought nothing of what it promised.
  if (totals[3] > 0)
    out.predicted_decrease =
        std::max(out.predicted_decrease - totals[3] / 2, 1e-3 * out.predicted_decrease);
  out.newly_behind = static_cast<std::uint64_t>(totals[4]);
  out.step_norm = ranks_.max(norm);
  return out;
}

void DistributedSystem::accept() {
  for (auto& piece : pieces_) piece->points().accept();
}

/// Scales that residuals decide are refused before (load).
double DistributedSystem::residual_scale(double) { return 0; }

Result<void> DistributedSystem::store(const std::filesystem::path& folder) {
  std::string failed;
  for (auto& piece : pieces_)
    if (const Result<void> done = write_piece(piece->store(), folder); !done.ok() && failed.empty())
      failed = done.error().what();
  failed = ranks_.first_text(failed);
  if (!failed.empty()) return Error(ErrorCode::unwritable_output, failed);
  return {};
}

std::uint64_t DistributedSystem::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& piece : pieces_) sum += piece->bytes();
  return sum;
}

}  // namespace sheaf
