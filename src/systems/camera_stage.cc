// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/camera_stage.h"

#include <algorithm>
#include <cmath>

namespace sheaf {

CameraStage::CameraStage(const Columns& columns) : columns_(columns) {
  const std::size_t padded = (static_cast<std::size_t>(columns.count) + 7) / 8 * 8;
  damping_.allocate(padded);
  step_.allocate(padded);
}

double CameraStage::gather(const ReducedSums& sums, double lambda) {
  vectors_.gather(sums, columns_);
  double gradient = 0;
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    const double square = std::clamp(vectors_.squares[c], kDiagonalFloor, kDiagonalCeiling);
    damping_[c] = lambda * square;
    gradient = std::max(gradient, std::abs(vectors_.rhs[c]) / std::sqrt(square));
  }
  return gradient;
}

bool CameraStage::solve(const ReducedSums& sums, const StepRequest& request,
                        const CoarseSpace* coarse, Step& step) {
  if (columns_.count == 0) return true;
  const CameraSystem system{
      sums,   &vectors_,      damping_.data(), request.forcing, request.cancelled,
      coarse, request.precise};
  const CameraSolution solution = solver_->solve(system, step_);
  step.linear_iterations = solution.iterations;
  return solution.solved && std::all_of(step_.begin(), step_.begin() + columns_.count,
                                        [](double x) { return std::isfinite(x); });
}

double CameraStage::add_decrease(double sum) const {
  for (std::int32_t c = 0; c < columns_.count; ++c)
    sum += step_[c] * (vectors_.rhs[c] + damping_[c] * step_[c]);
  return sum;
}

}  // namespace sheaf
