// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <vector>

#include "covariance/inverse.h"
#include "covariance/scene_gauge.h"
#include "platform/parallel.h"

namespace sheaf {

/// Single entries of the inverse without a factor: a solve by conjugate gradients for each row of a
/// function, preconditioned by the inverses of the diagonal blocks. The matrix is left singular,
/// for any solution of S y = P^T b serves: C_free b = P y (docs/covariance.md).
class IterativeInverse : public Inverse {
 public:
  /// All must outlive it. The gauge may not weigh points.
  IterativeInverse(const NormalEquations& equations, const SceneGauge& gauge,
                   const GaugeWeights& weights, std::vector<LinearFunction> functions,
                   Threads& threads);

  std::vector<double> of(const LinearFunction& function) const override;
  std::vector<double> across(std::size_t a, std::size_t b) const override;
  std::array<double, 9> of(const NormalEquations::Point& point, const double* X) const override;
  bool determined(std::int32_t column) const override {
    return equations_.squares()[static_cast<std::size_t>(column)] > 0;
  }
  std::uint64_t iterations() const { return iterations_; }
  /// Solves that did not come to their end: what they are of is told as infinite.
  std::uint64_t unfinished() const { return unfinished_; }

 private:
  void invert_diagonal();
  std::vector<double> solve(const LinearFunction& function) const;
  std::vector<double> applied(const std::vector<double>& X, std::size_t rows,
                              const LinearFunction& function) const;
  void into_range(std::vector<double>& b) const;
  void into_gauge(std::vector<double>& y) const;
  /// False where it does not end, or was cancelled.
  bool descend(const std::vector<double>& b, std::vector<double>& y,
               const std::function<bool()>* cancelled) const;
  void multiply(const std::vector<double>& x, std::vector<double>& y) const;
  void precondition(const std::vector<double>& r, std::vector<double>& z) const;
  void precondition_in_gauge(const std::vector<double>& r, std::vector<double>& z) const;

  const NormalEquations& equations_;
  const SceneGauge& gauge_;
  const GaugeWeights& weights_;
  const std::vector<LinearFunction> functions_;
  Threads& threads_;
  std::vector<double> diagonal_;             ///< inverse of each block, 9 x 9
  std::vector<std::vector<double>> solved_;  ///< of each function, rows x columns
  mutable std::atomic<std::uint64_t> iterations_{0}, unfinished_{0};
};

}  // namespace sheaf
