// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "sheaf/options.h"
#include "systems/system.h"

namespace sheaf {

constexpr double kLargestDamping = 1e32;
/// Gain ratios this close to 1 come from a model that was exact.
constexpr double kExact = 0.02, kCarefulDamping = 1e-4;
/// As the damping falls, conjugate gradients see ever smaller eigenvalues: at a tenth, iterations
/// double. From these on it falls to a fifth. With tighter solves than today's final-13682-like
/// needed 30 to 40 iterations a step so instead of 80, and was as soon at 1e-3 of the optimum and
/// sooner at 1e-4; scenes of up to 1778 images were much the same.
constexpr int kManyIterations = 16;

/// lambda, and how fast it grows while steps are rejected (Nielsen's rule; Madsen, Nielsen,
/// Tingleff 2004). A good step divides it by up to 10; the first one by 3, as one good step from
/// afar says little about the model near the optimum; by 100 where the model was exact twice in a
/// row, but then not below kCarefulDamping: there, ladybug-49 pays for haste with twice the steps.
struct Damping {
  double lambda;
  double growth = 2;
  bool first = true, was_exact = false;
  double floor = 1e-16;  ///< lambda does not fall below

  /// linear_iterations: that the step took; 0 by a factor.
  void shrink(double gain, int linear_iterations) {
    const bool costly = linear_iterations >= kManyIterations;
    const bool exact = std::abs(gain - 1) < kExact && !costly;
    double least = lambda * (first ? 1.0 / 3 : costly ? 0.2 : 0.1);
    if (exact && was_exact) least = std::max(lambda * 0.01, std::min(least, kCarefulDamping));
    lambda = std::max({least, lambda * (1 - std::pow(2 * gain - 1, 3)), floor});
    growth = 2;
    was_exact = exact;
    first = false;
  }
  void grow() {
    was_exact = false;
    lambda = std::min(lambda * growth, kLargestDamping);
    growth *= 2;
  }
};

/// How much of a loss's negative curvature steps may see (geometry/row_metric.h): its floor delta.
/// A step that gained more than the model promised asks for a lower one, a step that gained much
/// less for a higher one. Constants as tried in docs/math.md, section 12.
struct CurvatureFloor {
  static constexpr double kLeast = 1e-3, kDown = 0.3, kUp = 10;
  static constexpr double kGenerous = 1.3, kPoor = 0.7;
  /// A step that takes this much of the cost comes from afar: its gain says nothing of what is
  /// left.
  static constexpr double kFar = 0.2;
  double delta = 1;

  /// decrease: relative, of the cost.
  void accepted(double gain, double decrease) {
    if (gain > kGenerous && decrease < kFar)
      delta = std::max(kLeast, delta * kDown);
    else if (gain < kPoor)
      delta = std::min(1.0, delta / kDown);
  }
  /// False where it cannot rise.
  bool raise() {
    if (delta >= 1) return false;
    delta = std::min(1.0, delta * kUp);
    return true;
  }
};

/// What bounds the next step: Levenberg-Marquardt's damping and, for a dogleg, a radius. The
/// dogleg's Newton point is damped by the same rule, from the damping that the step taken amounts
/// to. The radius comes with the first rejected step, at half its length, and stays for as long as
/// it cuts steps. Under a loss the floor of its curvature answers first: a rejected step raises it,
/// and only where it cannot rise the damping; a dogleg shortens its step, and its next
/// linearisation has the higher floor.
class StepControl {
 public:
  StepControl(TrustRegion kind, double damping, bool robust = false)
      : dogleg_(kind == TrustRegion::dogleg), robust_(robust), damping_{damping} {
    if (robust) damping_.floor = kLeastRobustDamping;
  }

  bool dogleg() const { return dogleg_; }
  double damping() const { return damping_.lambda; }
  double radius() const { return radius_; }
  /// ScaledLoss::floor of the next step.
  double curvature_floor() const { return floor_.delta; }

  void accepted(double gain, const Trial& trial, int linear_iterations, double decrease = 0) {
    if (dogleg_) {
      const bool cut = trial.length >= radius_ * (1 - 1e-9);
      if (cut) damping_.lambda = std::max(damping_.lambda, trial.damping);
      radius_ = cut ? trial.length * (gain > 0.75 ? 3 : gain > 0.25 ? 1.5 : 0.5) : kUnbounded;
      shorten_ = 2;
    }
    damping_.shrink(gain, linear_iterations);
    if (!robust_) return;
    if (raise_)
      floor_.raise();
    else
      floor_.accepted(gain, decrease);
    raise_ = false;
  }
  /// Without a trial there was no step: the system was not positive definite.
  void rejected(const std::optional<Trial>& trial) {
    const bool shortens = dogleg_ && trial && std::isfinite(trial->length);
    if (robust_ && shortens) raise_ = true;
    if (!shortens) {
      if (!robust_ || !floor_.raise()) damping_.grow();
      return;
    }
    radius_ = std::min(radius_, trial->length) / shorten_;
    shorten_ *= 2;
  }
  /// All of it, to be written down.
  struct State {
    Damping damping{0};
    double radius = 0, shorten = 0;
    CurvatureFloor floor{};
    bool raise = false;
  };
  State state() const { return {damping_, radius_, shorten_, floor_, raise_}; }
  void restore(const State& state) {
    damping_ = state.damping;
    radius_ = state.radius;
    shorten_ = state.shorten;
    floor_ = state.floor;
    raise_ = state.raise;
  }

  bool exhausted() const { return damping_.lambda >= kLargestDamping || radius_ <= kLeastRadius; }

 private:
  static constexpr double kLeastRadius = 1e-32;
  static constexpr double kUnbounded = std::numeric_limits<double>::infinity();
  /// Less damping than this only lets what the loss leaves undetermined run away.
  static constexpr double kLeastRobustDamping = 1e-8;

  const bool dogleg_, robust_;
  Damping damping_;
  double radius_ = kUnbounded;
  double shorten_ = 2;
  CurvatureFloor floor_;
  bool raise_ = false;  ///< with the next linearisation
};

}  // namespace sheaf
