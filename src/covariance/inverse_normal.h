// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "covariance/normal_equations.h"
#include "covariance/scene_gauge.h"
#include "platform/parallel.h"

namespace sheaf {

class SparseCholesky;

/// Some columns of one block after another, as a linear function of the parameters: rows of six at
/// most.
struct LinearPart {
  std::uint32_t block;
  std::vector<double> by;  ///< rows x width of the block, row-major
};

/// Blocks of the inverse of the normal equations in a gauge.
class InverseNormal {
 public:
  /// Factors and inverts; the tiles of `equations` hold entries of the inverse from then on.
  /// Throws std::bad_alloc. Errors: usage where the matrix is not positive definite at all,
  /// memory_limit (0: none).
  static Result<std::unique_ptr<InverseNormal>> make(
      const Problem& problem, NormalEquations& equations, const SceneGauge& gauge,
      const GaugeWeights& weights, std::uint64_t memory_limit_bytes, Threads& threads);

  /// rows x rows, of a function of some blocks that rows couple pair by pair.
  std::vector<double> of(const std::vector<LinearPart>& parts, std::size_t rows) const;
  /// 3 x 3, of an eliminated point at X.
  std::array<double, 9> of(const NormalEquations::Point& point, const double* X) const;
  /// A C A^T of one observation of this point, 2 x 2: no gauge changes it.
  std::array<double, 4> of_fit(const NormalEquations::Point& point, const ObservationRows::Row& row,
                               bool points_held) const;
  /// Whether the column's variance is finite.
  bool determined(std::int32_t column) const {
    return undetermined_[static_cast<std::size_t>(column)] == 0;
  }
  bool ridged() const { return ridged_; }

 private:
  InverseNormal(NormalEquations& equations, const SceneGauge& gauge)
      : equations_(equations), gauge_(gauge) {}
  const double* tile(std::uint32_t a, std::uint32_t b, bool& transposed) const;
  bool factor(SparseCholesky& cholesky, double ridge, Threads& threads) const;
  void solve_gauge(const Problem& problem, const GaugeWeights& weights, SparseCholesky& cholesky);
  std::vector<double> of_point_gauge(const NormalEquations::Point& point, const double* X) const;
  void into_gauge(const double* G, const double* M, std::size_t rows, double* C) const;
  void take_inverse(const SparseCholesky& cholesky);

  NormalEquations& equations_;
  const SceneGauge& gauge_;
  std::vector<std::int32_t> pinned_;
  std::vector<std::uint8_t> is_pinned_, undetermined_;
  std::vector<double> M_;          ///< count x columns: A C
  std::vector<double> N_;          ///< count x count: A C A^T
  std::vector<double> at_points_;  ///< A of points: (G^T W G)^-1
  bool ridged_ = false;
};

}  // namespace sheaf
