// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// BundleSystem's steps within a radius. docs/math.md, section 13, has the algebra.
#include <cmath>

#include "systems/bundle_system.h"

namespace sheaf {

bool BundleSystem::only_radius_is_new(const StepRequest& request) const {
  return proposed_ && request.dogleg && request_.dogleg && request.damping == request_.damping &&
         request.loss.kind == request_.loss.kind &&
         request.loss.scale_px == request_.loss.scale_px && request.precise == request_.precise;
}

/// Conjugate gradients would have stopped at the radius: their path is cut there.
void BundleSystem::shorten_newton() {
  double square = 0;
  for (std::int32_t c = 0; c < columns_.count; ++c)
    square += camera_step_[c] * damping_[c] * camera_step_[c];
  const double radius = request_.radius;
  if (residual_ == nullptr || !(square > radius * radius * request_.damping)) return;
  const CameraSolution solution = solver_->shorten(camera_system(request_), camera_step_);
  if (!solution.solved) return;
  residual_ = solution.residual;
  cut_ = true;
  plane_.reset();
}

/// Whether the radius cuts the Newton point off is known once it was tried; where it is to be
/// expected, one pass finds out. Steepest descent is computed where it does, once for a state.
Trial BundleSystem::trial() {
  if (!request_.dogleg) return try_step({});
  std::optional<Trial> newton;
  if (!plane_ && std::isinf(request_.radius))
    newton = try_step({});
  else if (!plane_)
    newton_damping_ = passes().point_damping(camera_step_);
  if (!plane_) measure_newton();
  DoglegStep step;
  if (cut_ || plane_->nn > request_.radius * request_.radius) {
    measure_descent();
    step = (cut_ ? best_in_plane : dogleg)(*plane_, request_.radius);
  }
  Trial out = newton && step.is_newton() ? *newton : try_step(step);
  if (!step.is_newton()) out.predicted_decrease = decrease_of(*plane_, step);
  out.length = length_of(*plane_, step);
  out.damping = damping_of(*plane_, step);
  return out;
}

DoglegPasses& BundleSystem::passes() {
  if (passes_ == nullptr)
    passes_ =
        std::make_unique<DoglegPasses>(columns_, held_state(), rules_.held, kernels_, threads_);
  return *passes_;
}

void BundleSystem::measure_newton() {
  DoglegPlane& p = plane_.emplace();
  p.damping = request_.damping;
  p.vn = point_decrease_;
  p.nn = newton_damping_;
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    p.vn += camera_step_[c] * vectors_.rhs[c];
    p.nn += camera_step_[c] * damping_[c] * camera_step_[c];
  }
  p.nn /= p.damping;
  p.nHn = p.vn - p.damping * p.nn;
  // Conjugate gradients leave a residual orthogonal to the step, unless the radius cut it.
  if (cut_) p.nHn -= dot(camera_step_, residual_);
}

void BundleSystem::measure_descent() {
  DoglegPlane& p = *plane_;
  if (p.vv > 0) return;
  if (!descended_) passes().descend(damping_.data(), request_.damping);
  descended_ = true;
  p.vv = passes().gradient2();
  p.vHv = passes().curvature();
  p.vHn = p.vv - p.damping * p.vn - dot(passes().direction(), residual_);
}

double BundleSystem::dot(const Buffer<double>& a, const double* b) const {
  double sum = 0;
  for (std::int32_t c = 0; b != nullptr && c < columns_.count; ++c) sum += a[c] * b[c];
  return sum;
}

const Buffer<double>& BundleSystem::blend_cameras(const DoglegStep& step) {
  if (step.is_newton()) return camera_step_;
  const Buffer<double>& v = passes_->direction();
  if (blended_step_.size() == 0) blended_step_.allocate(camera_step_.size());
  for (std::int32_t c = 0; c < columns_.count; ++c)
    blended_step_[c] = step.newton * camera_step_[c] + step.descent * v[c];
  return blended_step_;
}

}  // namespace sheaf
