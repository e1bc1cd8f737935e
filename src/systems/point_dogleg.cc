// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// PointSystem's steps within a radius. docs/math.md, section 13, has the algebra.
#include <cmath>

#include "systems/point_system.h"

namespace sheaf {

bool PointSystem::only_radius_is_new(const StepRequest& request) const {
  return proposed_ && request.dogleg && request_.dogleg && request.damping == request_.damping &&
         request.loss == request_.loss && request.precise == request_.precise;
}

/// Whether the radius cuts the Newton point off is known once it was tried; where it is to be
/// expected, one pass finds out. Steepest descent is computed where it does, once for a state.
Trial PointSystem::trial() {
  if (!request_.dogleg) return try_step({request_.stretch, 0});
  std::optional<Trial> newton;
  if (!plane_ && std::isinf(request_.radius))
    newton = try_step({});
  else if (!plane_)
    newton_damping_ = passes().point_damping(stage_.step());
  if (!plane_) measure_newton();
  DoglegStep step;
  if (stage_.cut() || plane_->nn > request_.radius * request_.radius) {
    measure_descent();
    step = (stage_.cut() ? best_in_plane : dogleg)(*plane_, request_.radius);
  }
  Trial out = newton && step.is_newton() ? *newton : try_step(step);
  if (!step.is_newton()) out.predicted_decrease = less_what_was_left(decrease_of(*plane_, step));
  out.length = length_of(*plane_, step);
  out.damping = damping_of(*plane_, step);
  return out;
}

DoglegPasses& PointSystem::passes() {
  if (passes_ == nullptr)
    passes_ = std::make_unique<DoglegPasses>(rows().make_dogleg(), columns_, rows().chunks(),
                                             rows().num_blocks(), piece_.rules().held, threads_);
  return *passes_;
}

void PointSystem::measure_newton() {
  DoglegPlane& p = plane_.emplace();
  p.damping = request_.damping;
  p.vn = stage_.add_promise(point_decrease_);
  p.nn = stage_.add_damping(newton_damping_) / p.damping;
  p.nHn = p.vn - p.damping * p.nn;
  // Conjugate gradients leave a residual orthogonal to the step, unless the radius cut it.
  if (stage_.cut()) p.nHn -= stage_.dot(stage_.step(), stage_.residual());
}

void PointSystem::measure_descent() {
  DoglegPlane& p = *plane_;
  if (p.vv > 0) return;
  if (!descended_) passes().descend(stage_.damping(), request_.damping);
  descended_ = true;
  p.vv = passes().gradient2();
  p.vHv = passes().curvature();
  p.vHn = p.vv - p.damping * p.vn - stage_.dot(passes().direction(), stage_.residual());
}

const Buffer<double>& PointSystem::blend_cameras(const DoglegStep& step) {
  if (step.is_newton()) return stage_.step();
  if (step.descent == 0) return stage_.blend(step.newton, 0, stage_.step());
  return stage_.blend(step.newton, step.descent, passes_->direction());
}

}  // namespace sheaf
