// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "covariance/inverse.h"
#include "covariance/scene_gauge.h"
#include "platform/parallel.h"

namespace sheaf {

class SparseCholesky;

/// By a factor: all blocks that its pattern holds.
class InverseNormal : public Inverse {
 public:
  /// Factors and inverts; the tiles of `equations` hold entries of the inverse from then on.
  /// `functions`: what `across` can be asked for, one solve for each of their rows.
  /// Throws std::bad_alloc. Errors: usage where the matrix is not positive definite at all,
  /// memory_limit (0: none).
  static Result<std::unique_ptr<InverseNormal>> make(
      const Problem& problem, NormalEquations& equations, const SceneGauge& gauge,
      const GaugeWeights& weights, std::vector<LinearFunction> functions,
      std::uint64_t memory_limit_bytes, Threads& threads);

  std::vector<double> of(const LinearFunction& function) const override;
  std::vector<double> across(std::size_t a, std::size_t b) const override;
  std::array<double, 9> of(const NormalEquations::Point& point, const double* X) const override;
  bool determined(std::int32_t column) const override {
    return undetermined_[static_cast<std::size_t>(column)] == 0;
  }
  /// A C A^T of one observation of this point, 2 x 2: no gauge changes it.
  std::array<double, 4> of_fit(const NormalEquations::Point& point, const ObservationRows::Row& row,
                               bool points_held) const;
  bool ridged() const { return ridged_; }

 private:
  InverseNormal(NormalEquations& equations, const SceneGauge& gauge)
      : equations_(equations), gauge_(gauge) {}
  const double* tile(std::uint32_t a, std::uint32_t b, bool& transposed) const;
  bool factor(SparseCholesky& cholesky, double ridge, Threads& threads) const;
  void solve_gauge(const Problem& problem, const GaugeWeights& weights, SparseCholesky& cholesky);
  std::vector<double> of_point_gauge(const NormalEquations::Point& point, const double* X) const;
  /// What a function sees of the gauge.
  struct InGauge {
    std::vector<double> G;  ///< rows x count
    std::vector<double> M;  ///< count x rows: of A C
  };
  InGauge in_gauge(const LinearFunction& function) const;
  void into_gauge(const InGauge& a, const InGauge& b, double* C) const;
  void solve_functions(SparseCholesky& cholesky);
  void take_inverse(const SparseCholesky& cholesky);

  NormalEquations& equations_;
  const SceneGauge& gauge_;
  std::vector<std::int32_t> pinned_;
  std::vector<std::uint8_t> is_pinned_, undetermined_;
  std::vector<double> M_;          ///< count x columns: A C
  std::vector<double> N_;          ///< count x count: A C A^T
  std::vector<double> at_points_;  ///< A of points: (G^T W G)^-1
  std::vector<LinearFunction> functions_;
  std::vector<std::vector<double>> solved_;  ///< of each function, rows x columns: function C
  bool ridged_ = false;
};

}  // namespace sheaf
