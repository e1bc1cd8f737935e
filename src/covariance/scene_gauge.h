// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "covariance/normal_equations.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// The motions of a scene that no row notices: combinations of three shifts, three turns and a
/// change of size about its middle, as steps of camera columns (count() for each) and of points.
class SceneGauge {
 public:
  SceneGauge(const Problem& problem, const NormalEquations& equations);

  std::size_t count() const { return free_.size() / 7; }
  /// Names of the seven that are free by themselves.
  std::vector<std::string> names() const;
  /// columns x count().
  const std::vector<double>& of_columns() const { return columns_; }
  const double* of_column(std::int32_t c) const {
    return columns_.data() + count() * static_cast<std::size_t>(c);
  }
  /// 3 x count(), at a place of the world.
  void of_point(const double* X, double* out) const;

  /// count() columns without which nothing is free: minimal constraints. scale: sqrt(diag) of each
  /// column.
  std::vector<std::int32_t> minimal_constraints(const std::vector<double>& squares) const;

 private:
  static constexpr std::size_t kAll = 7;
  using Directions = std::array<double, 3 * kAll>;
  void place(const Problem& problem);
  std::vector<double> all_of_columns(const Problem& problem, const ParameterBlocks& blocks) const;
  void find_free(const std::vector<double>& all, const std::vector<double>& sums,
                 const std::vector<double>& squares);
  Directions all_of_point(const double* X) const;
  void add_pose(std::uint32_t block, const Pose& pose, const ParameterBlocks& blocks,
                std::vector<double>& all) const;

  std::array<double, 3> origin_{};
  double unit_ = 1;
  std::vector<double> free_;     ///< 7 x count(): combinations
  std::vector<double> columns_;  ///< columns x count()
};

/// What a gauge is held by: A (count x columns and points) with delta' = delta - G A delta.
struct GaugeWeights {
  std::vector<double> of_columns;  ///< count x columns
  std::vector<double>
      of_points;  ///< 9 (3 x 3) of (G^T W G)^-1, count x count; empty: cameras alone
  std::string words;
};
/// Errors: usage where the gauge does not hold all that is free.
Result<GaugeWeights> gauge_weights(const Problem& problem, const ParameterBlocks& blocks,
                                   const SceneGauge& gauge, Gauge kind);

}  // namespace sheaf
