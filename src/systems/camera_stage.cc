// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/camera_stage.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "eliminate/kernels.h"

namespace sheaf {
namespace {

// Conjugate gradients count by how much the model falls; a column that is sent to its bound falls
// 1e8 times as deep as its own row would.
constexpr double kStepsToBound = 1e-8;

}  // namespace

CameraStage::CameraStage(const Columns& columns, const Reduction& reduction)
    : columns_(columns), reduction_(reduction) {
  const std::size_t padded = (static_cast<std::size_t>(columns.count) + 7) / 8 * 8;
  damping_.allocate(padded);
  step_.allocate(padded);
}

double CameraStage::gather(const ReducedSums& sums, double lambda, std::vector<StepBound> bounds) {
  vectors_.gather(sums, columns_);
  bounds_.begin(std::move(bounds), vectors_.rhs, vectors_.squares);
  double gradient = 0;
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    const double square = std::clamp(vectors_.squares[c], kDiagonalFloor, kDiagonalCeiling);
    damping_[c] = lambda * square;
    if (bounds_.holds(c)) continue;
    gradient = std::max(gradient, std::abs(vectors_.rhs[c]) / std::sqrt(square));
  }
  reduction_.max(&gradient, 1);
  return gradient;
}

CameraSystem CameraStage::system(const ReducedSums& sums, const StepRequest& request) const {
  return {sums,
          &vectors_,
          damping_.data(),
          bounds_.steps() ? kStepsToBound * request.forcing : request.forcing,
          request.cancelled,
          corrected_ ? coarse_.get() : nullptr,
          request.precise || bounds_.hold_any(),
          request.radius,
          request.damping,
          request.dogleg};
}

bool CameraStage::solve(const ReducedSums& sums, const StepRequest& request, Step& step) {
  residual_ = nullptr;
  cut_ = false;
  if (columns_.count == 0) return true;
  do {
    if (bounds_.prescribe(vectors_.rhs, damping_)) solver_->restore({});
    const bool solved = solve_once(sums, request, step);
    bounds_.put_back(vectors_.rhs, damping_, step_);
    if (!solved) return false;
  } while (bounds_.add_crossing(step_));
  return true;
}

bool CameraStage::solve_once(const ReducedSums& sums, const StepRequest& request, Step& step) {
  corrected_ = coarse_ && coarse_->factor(sums.of_rows != nullptr ? sums.of_rows : sums.diagonal,
                                          damping_.data(), sums.couplings);
  const CameraSolution solution = solver_->solve(system(sums, request), step_);
  ++solves_;
  step.linear_iterations += solution.iterations;
  if (coarse_) coarse_->solved(solution.iterations);
  residual_ = solution.residual;
  cut_ = solution.cut;
  return solution.solved && std::all_of(step_.begin(), step_.begin() + columns_.count,
                                        [](double x) { return std::isfinite(x); });
}

bool CameraStage::shorten(const ReducedSums& sums, const StepRequest& request) {
  const double radius = request.radius;
  if (residual_ == nullptr || !(add_damping(0) > radius * radius * request.damping)) return false;
  const CameraSolution solution = solver_->shorten(system(sums, request), step_);
  if (!solution.solved) return false;
  residual_ = solution.residual;
  cut_ = true;
  return true;
}

void CameraStage::moved(double cost) {
  if (coarse_) coarse_->moved(cost);
}

CameraStage::History CameraStage::history() const {
  History out;
  out.modes = solver_->history();
  if (coarse_) out.coarse = coarse_->history();
  return out;
}

bool CameraStage::restore(const History& history) {
  if ((coarse_ != nullptr) != history.coarse.has_value()) return false;
  return solver_->restore(history.modes) && (!coarse_ || coarse_->restore(*history.coarse));
}

double CameraStage::add_decrease(double sum) const {
  for (std::int32_t c = 0; c < columns_.count; ++c)
    sum += step_[c] * (vectors_.rhs[c] + damping_[c] * step_[c]);
  return sum + bounds_.correction();
}

double CameraStage::add_damping(double sum) const {
  for (std::int32_t c = 0; c < columns_.count; ++c) sum += step_[c] * damping_[c] * step_[c];
  return sum;
}

double CameraStage::add_promise(double sum) const {
  for (std::int32_t c = 0; c < columns_.count; ++c) sum += step_[c] * vectors_.rhs[c];
  return sum;
}

double CameraStage::dot(const Buffer<double>& a, const double* b) const {
  double sum = 0;
  for (std::int32_t c = 0; b != nullptr && c < columns_.count; ++c) sum += a[c] * b[c];
  return sum;
}

const Buffer<double>& CameraStage::blend(double newton, double descent,
                                         const Buffer<double>& direction) {
  if (blended_.size() == 0) blended_.allocate(step_.size());
  for (std::int32_t c = 0; c < columns_.count; ++c)
    blended_[c] = newton * step_[c] + descent * direction[c];
  return blended_;
}

std::uint64_t CameraStage::bytes() const {
  return solver_->bytes() + (coarse_ ? coarse_->bytes() : 0);
}

}  // namespace sheaf
