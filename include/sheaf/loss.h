// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace sheaf {

enum class LossKind : std::uint8_t { none, huber, soft_l1, cauchy, tukey, geman_mcclure };

/// "none", "huber", "soft-l1", "cauchy", "tukey", "geman-mcclure".
const char* to_string(LossKind kind);

/// The scale is estimated from the residuals, in rounds.
inline constexpr double kAutomaticScale = 0;

/// What an observation's residual r costs: 1/2 rho(|r|^2) in place of 1/2 |r|^2. docs/math.md has
/// the formulas. Made by naming one: SolveOptions{.loss = Huber{1.5}}.
struct Loss {
  LossKind kind = LossKind::none;
  /// Pixels, not squared: residuals well below count as they are, those well above count less.
  double scale_px = kAutomaticScale;
  /// Begin with a scale at which every residual is in the convex part, and tighten it in rounds
  /// (graduated non-convexity): for the losses that forget outliers, when the start is bad.
  bool graduated = false;
};

/// sqrt(s) beyond the scale: convex, and every outlier still pulls with the force of one pixel
/// scale.
struct Huber {
  double scale_px = kAutomaticScale;
  operator Loss() const { return {LossKind::huber, scale_px, false}; }
};

/// Huber's smooth brother: 2 c^2 (sqrt(1 + s / c^2) - 1).
struct SoftL1 {
  double scale_px = kAutomaticScale;
  operator Loss() const { return {LossKind::soft_l1, scale_px, false}; }
};

/// c^2 log(1 + s / c^2): the pull of an outlier falls with its distance.
struct Cauchy {
  double scale_px = kAutomaticScale;
  bool graduated = false;
  operator Loss() const { return {LossKind::cauchy, scale_px, graduated}; }
};

/// Tukey's biweight: beyond the scale an observation has no pull at all.
struct Tukey {
  double scale_px = kAutomaticScale;
  bool graduated = false;
  operator Loss() const { return {LossKind::tukey, scale_px, graduated}; }
};

/// s / (1 + s / c^2): the pull of an outlier falls with the third power of its distance.
struct GemanMcClure {
  double scale_px = kAutomaticScale;
  bool graduated = false;
  operator Loss() const { return {LossKind::geman_mcclure, scale_px, graduated}; }
};

}  // namespace sheaf
