// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "starts/sights.h"

namespace sheaf {

/// J^T J and J^T r of a block of at most kMost parameters.
template <std::size_t kMost>
struct NormalEquations {
  std::size_t size = kMost;
  std::array<std::array<double, kMost>, kMost> A{};
  std::array<double, kMost> g{};

  void clear() {
    A = {};
    g = {};
  }
  /// Both rows of an observation: J of its pixel, the residual, and the loss's weight.
  void add(const std::array<std::array<double, kMost>, 2>& J, const std::array<double, 2>& r,
           double weight) {
    for (std::size_t row = 0; row < 2; ++row)
      for (std::size_t i = 0; i < size; ++i) {
        const double x = weight * J[row][i];
        g[i] += x * r[row];
        for (std::size_t j = 0; j <= i; ++j) A[i][j] += x * J[row][j];
      }
  }
};

/// Solves (A + damping diag(A)) d = -g by Cholesky's factor; false where that does not exist.
template <std::size_t kMost>
bool solve_damped(const NormalEquations<kMost>& N, double damping, std::array<double, kMost>& d) {
  std::array<std::array<double, kMost>, kMost> L{};
  for (std::size_t i = 0; i < N.size; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = N.A[i][j] * (i == j ? 1 + damping : 1);
      for (std::size_t k = 0; k < j; ++k) sum -= L[i][k] * L[j][k];
      if (i != j) {
        L[i][j] = sum / L[j][j];
      } else if (!(sum > 1e-300)) {
        return false;
      } else {
        L[i][i] = std::sqrt(sum);
      }
    }
  }
  for (std::size_t i = 0; i < N.size; ++i) {
    double sum = -N.g[i];
    for (std::size_t k = 0; k < i; ++k) sum -= L[i][k] * d[k];
    d[i] = sum / L[i][i];
  }
  for (std::size_t i = N.size; i-- > 0;) {
    double sum = d[i];
    for (std::size_t k = i + 1; k < N.size; ++k) sum -= L[k][i] * d[k];
    d[i] = sum / L[i][i];
  }
  return true;
}

/// Levenberg-Marquardt of one block by itself: a point, an image, a lens. No step raises the cost
/// or the number of observations behind their camera. A Block has kMost,
///   Fit linearise(NormalEquations<kMost>&): at the held state,
///   Fit attempt(const std::array<double, kMost>& step): at another state,
///   void take(): which becomes the held one.
template <class Block>
Fit descend(Block& block, int most_trials) {
  constexpr double kFirstDamping = 1e-3, kDown = 0.1, kUp = 5, kLeast = 1e-12;
  constexpr double kSettled = 1e-3;
  NormalEquations<Block::kMost> N;
  Fit held = block.linearise(N);
  double damping = kFirstDamping;
  std::array<double, Block::kMost> step{};
  for (int trial = 0; trial < most_trials && std::isfinite(held.cost); ++trial) {
    const bool solved = solve_damped(N, damping, step);
    const Fit tried =
        solved ? block.attempt(step) : Fit{std::numeric_limits<double>::infinity(), 0};
    if (!(tried.cost < held.cost && tried.behind <= held.behind)) {
      damping *= kUp;
      continue;
    }
    const bool settled = held.cost - tried.cost < kSettled * held.cost;
    block.take();
    held = tried;
    if (settled) break;
    damping = std::max(kLeast, damping * kDown);
    block.linearise(N);
  }
  return held;
}

}  // namespace sheaf
