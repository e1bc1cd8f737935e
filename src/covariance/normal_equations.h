// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "covariance/block_tiles.h"
#include "covariance/observation_rows.h"
#include "covariance/parameter_blocks.h"
#include "geometry/loss.h"
#include "sheaf/problem.h"
#include "systems/term.h"

namespace sheaf {

/// What the residuals are like, of observations under their loss.
struct ResidualMoments {
  std::uint64_t observations = 0;
  double square = 0;         ///< sum w^2 s
  double weight = 0;         ///< sum w
  double slope = 0;          ///< sum w + s rho'': the mean derivative of the score, by 2 components
  double weight_square = 0;  ///< sum w^2
  double slope_square = 0;   ///< sum of half the trace of the square of the score's derivative
  double terms_square = 0;   ///< of the terms and of points' own rows: sum w s
  std::uint64_t terms = 0;   ///< their rows
};

/// Half the trace of the square of w I + 2 rho'' r r^T, the derivative of the score by r.
inline double slope_square(const LossValue<double>& rho, double s) {
  const double along = rho.second * s;
  return rho.first * rho.first + 2 * along * (rho.first + along);
}

/// The undamped normal equations at a state, J^T W J with W the weights of the loss, points
/// eliminated: by plain formulas, once. Rows of one point: W = sum Jc^T w Jp of each block.
class NormalEquations {
 public:
  /// A point's part: V, its inverse's factor and W of the blocks that see it.
  struct Point {
    std::array<double, 9> V{}, inverse{};
    bool seen = false, determined = false;
    std::vector<std::uint32_t> blocks;      ///< ascending
    std::vector<std::array<double, 27>> W;  ///< 3 x 9 of each: W^T, row-major
  };

  /// The problem and the options must outlive it. Throws std::bad_alloc.
  NormalEquations(const Problem& problem, const Fixed& fixed, const ScaledLoss& loss);

  const ParameterBlocks& blocks() const { return blocks_; }
  const ObservationRows& rows() const { return rows_; }
  BlockTiles& tiles() { return *tiles_; }
  const BlockTiles& tiles() const { return *tiles_; }
  const std::vector<double>& squares() const { return squares_; }  ///< diag(J^T W J) of the columns
  const ResidualMoments& moments() const { return moments_; }
  std::uint64_t eliminated_points() const { return eliminated_; }
  bool points_held() const { return points_held_; }
  double weight_of(const ObservationRows::Row& row) const;

  /// Linearises a point again; visit(row, weight), where it is given, sees its observations' rows.
  using Visit = std::function<void(const ObservationRows::Row& row, double weight)>;
  void point(std::size_t index, Point& out, const Visit& visit = {}) const;
  /// Its observations; none of a kept one.
  const std::uint64_t* begin_of(std::size_t point) const { return order_.data() + first_[point]; }
  const std::uint64_t* end_of(std::size_t point) const { return order_.data() + first_[point + 1]; }

  /// Of directions: `of_point` writes what they do to a point, 3 x count.
  using PointDirections = std::function<void(std::size_t point, double* of)>;
  /// G^T J^T W J G, count x count, summed over rows: what is free comes out as 0 to rounding. G:
  /// columns x count.
  std::vector<double> gram(const std::vector<double>& G, std::size_t count,
                           const PointDirections& of_point) const;

 private:
  struct TermRowsOf {
    std::vector<std::uint32_t> blocks;
    std::vector<double> J;  ///< rows x 9 for each block, sqrt(w) times
    std::vector<double> r;
    std::size_t rows = 0;
  };

  void sort_by_point();
  void make_pattern();
  void add_terms();
  void add_points();
  void measure(const ObservationRows::Row& row);
  void add_observation(const ObservationRows::Row& row, double weight);
  void eliminate(const Point& point);
  std::array<double, 9> point_prior_root(std::size_t point) const;
  TermRowsOf rows_of(const Term& term, const CameraState& state) const;

  const Problem& problem_;
  const ScaledLoss loss_;
  const bool points_held_;
  const ParameterBlocks blocks_;
  const ObservationRows rows_;
  std::vector<TermRowsOf> terms_;
  std::vector<std::int64_t> prior_;           ///< of each point in Terms::points, or -1
  std::vector<std::uint64_t> order_, first_;  ///< observations by point
  std::unique_ptr<BlockTiles> tiles_;
  std::vector<double> squares_;
  ResidualMoments moments_;
  std::uint64_t eliminated_ = 0;
};

}  // namespace sheaf
