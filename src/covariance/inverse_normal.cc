// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/inverse_normal.h"

#include <algorithm>
#include <cmath>

#include "eliminate/kernel_table.h"
#include "platform/cancel.h"
#include "platform/memory.h"
#include "reduced/sparse_cholesky.h"

namespace sheaf {
namespace {

/// Added to the diagonal, relatively, where the matrix is singular beside its gauge; a variance
/// that comes near its inverse is the ridge's.
constexpr double kRidge = 1e-12, kRidged = 1e-3;
constexpr double kHopeless = 1e14;
/// Between two questions whether to go on.
constexpr std::size_t kPoints = 64, kTiles = 1 << 14;

}  // namespace

/// Entries of tile (a, b), a < b: transposed.
const double* InverseNormal::tile(std::uint32_t a, std::uint32_t b, bool& transposed) const {
  transposed = a < b;
  return equations_.tiles().of(std::max(a, b), std::min(a, b));
}

bool InverseNormal::factor(SparseCholesky& cholesky, double ridge, Threads& threads) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const BlockTiles& tiles = equations_.tiles();
  const SymbolicFactor& symbolic = cholesky.symbolic();
  // Tiles by the supernodes that take parts of them.
  std::vector<std::uint64_t> first(symbolic.supernodes.size() + 1, 0);
  std::vector<std::pair<std::int32_t, std::uint64_t>> takes;
  for (std::uint64_t t = 0; t < tiles.size(); ++t) {
    std::int32_t last = -1;
    const auto at = [&](std::uint32_t block) {
      for (std::int32_t c = blocks.first[block]; c < blocks.first[block + 1]; ++c) {
        const std::int32_t owner =
            symbolic
                .owner[static_cast<std::size_t>(symbolic.position[static_cast<std::size_t>(c)])];
        if (owner != last) takes.push_back({owner, t});
        last = owner;
      }
    };
    at(tiles.row(t));
    if (tiles.column(t) != tiles.row(t)) at(tiles.column(t));
  }
  std::sort(takes.begin(), takes.end());
  takes.erase(std::unique(takes.begin(), takes.end()), takes.end());
  for (const auto& [owner, t] : takes) ++first[static_cast<std::size_t>(owner) + 1];
  for (std::size_t s = 1; s < first.size(); ++s) first[s] += first[s - 1];
  const auto fill = [&](std::size_t s) {
    const Supernode& node = symbolic.supernodes[s];
    for (std::uint64_t i = first[s]; i < first[s + 1]; ++i) {
      const std::uint64_t t = takes[i].second;
      const std::uint32_t a = tiles.row(t), b = tiles.column(t);
      for (std::int32_t r = blocks.first[a]; r < blocks.first[a + 1]; ++r)
        for (std::int32_t c = blocks.first[b]; c < (a == b ? r + 1 : blocks.first[b + 1]); ++c) {
          const std::int32_t low = std::min(symbolic.position[static_cast<std::size_t>(r)],
                                            symbolic.position[static_cast<std::size_t>(c)]);
          if (low < node.first || low >= node.first + node.width) continue;
          double value = tiles.at(t)[9 * (r - blocks.first[a]) + (c - blocks.first[b])];
          if (is_pinned_[static_cast<std::size_t>(r)] != 0 ||
              is_pinned_[static_cast<std::size_t>(c)] != 0)
            value = r == c ? 1 : 0;
          else if (r == c)
            value += ridge * equations_.squares()[static_cast<std::size_t>(c)];
          cholesky.panels()[cholesky.offset(r, c)] = value;
        }
    }
  };
  const bool done = cholesky.factor(threads, fill, cancel_question());
  if (!done) poll_cancelled();
  return done;
}

/// M = A C and N = A C A^T, C the inverse under minimal constraints: one solve for each freedom.
void InverseNormal::solve_gauge(const Problem& problem, const GaugeWeights& weights,
                                SparseCholesky& cholesky) {
  const std::size_t d = gauge_.count(), n = is_pinned_.size();
  const ParameterBlocks& blocks = equations_.blocks();
  at_points_ = weights.of_points;
  M_ = weights.of_columns;
  NormalEquations::Point point;
  std::vector<double> g(3 * d), a(3 * d);
  const auto weights_of = [&](std::size_t p) {  // A_p, d x 3
    gauge_.of_point(&problem.points[3 * p], g.data());
    for (std::size_t k = 0; k < d; ++k)
      for (std::size_t i = 0; i < 3; ++i) {
        a[3 * k + i] = 0;
        for (std::size_t l = 0; l < d; ++l) a[3 * k + i] += at_points_[d * k + l] * g[d * i + l];
      }
  };
  const bool by_points = !at_points_.empty();
  for (std::size_t p = 0; by_points && p < problem.num_points(); ++p) {
    if (p % kPoints == 0) poll_cancelled();
    equations_.point(p, point);
    if (!point.determined) continue;
    weights_of(p);
    for (std::size_t b = 0; b < point.blocks.size(); ++b)
      for (std::size_t r = 0; r < blocks.width(point.blocks[b]); ++r)
        for (std::size_t k = 0; k < d; ++k)
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t l = 0; l < 3; ++l)
              M_[n * k + static_cast<std::size_t>(blocks.first[point.blocks[b]]) + r] -=
                  point.W[b][9 * i + r] * point.inverse[3 * i + l] * a[3 * k + l];
  }
  for (std::size_t k = 0; k < d; ++k) {
    poll_cancelled();
    for (const std::int32_t c : pinned_) M_[n * k + static_cast<std::size_t>(c)] = 0;
    cholesky.solve(&M_[n * k]);
    for (const std::int32_t c : pinned_) M_[n * k + static_cast<std::size_t>(c)] = 0;
  }
  N_.assign(d * d, 0);
  for (std::size_t k = 0; k < d; ++k)
    for (std::size_t l = 0; l < d; ++l)
      for (std::size_t c = 0; c < n; ++c)
        N_[d * k + l] += weights.of_columns[n * l + c] * M_[n * k + c];
  for (std::size_t p = 0; by_points && p < problem.num_points(); ++p) {
    if (p % kPoints == 0) poll_cancelled();
    equations_.point(p, point);
    if (!point.determined) continue;
    weights_of(p);
    const std::vector<double> M = of_point_gauge(point, problem.points.data() + 3 * p);
    for (std::size_t k = 0; k < d; ++k)
      for (std::size_t l = 0; l < d; ++l)
        for (std::size_t i = 0; i < 3; ++i) N_[d * k + l] += M[3 * k + i] * a[3 * l + i];
  }
}

/// A C of a point's three columns, d x 3: V^-1 (A_p^T - W^T M^T).
std::vector<double> InverseNormal::of_point_gauge(const NormalEquations::Point& point,
                                                  const double* X) const {
  const std::size_t d = gauge_.count(), n = is_pinned_.size();
  const ParameterBlocks& blocks = equations_.blocks();
  std::vector<double> right(3 * d, 0), out(3 * d, 0);
  if (!at_points_.empty()) {
    std::vector<double> g(3 * d);
    gauge_.of_point(X, g.data());
    for (std::size_t k = 0; k < d; ++k)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t l = 0; l < d; ++l)
          right[3 * k + i] += at_points_[d * k + l] * g[d * i + l];
  }
  for (std::size_t b = 0; b < point.blocks.size(); ++b)
    for (std::size_t r = 0; r < blocks.width(point.blocks[b]); ++r)
      for (std::size_t k = 0; k < d; ++k)
        for (std::size_t i = 0; i < 3; ++i)
          right[3 * k + i] -=
              M_[n * k + static_cast<std::size_t>(blocks.first[point.blocks[b]]) + r] *
              point.W[b][9 * i + r];
  for (std::size_t k = 0; k < d; ++k)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t l = 0; l < 3; ++l)
        out[3 * k + i] += point.inverse[3 * i + l] * right[3 * k + l];
  return out;
}

InverseNormal::InGauge InverseNormal::in_gauge(const LinearFunction& function) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const std::size_t d = gauge_.count(), n = is_pinned_.size(), rows = function.rows;
  InGauge out{std::vector<double>(rows * d, 0), std::vector<double>(d * rows, 0)};
  for (const LinearPart& part : function.parts) {
    const std::size_t width = blocks.width(part.block);
    const auto first = static_cast<std::size_t>(blocks.first[part.block]);
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t k = 0; k < width; ++k)
        for (std::size_t g = 0; g < d; ++g) {
          out.G[d * i + g] += part.by[width * i + k] * gauge_.of_columns()[d * (first + k) + g];
          out.M[rows * g + i] += part.by[width * i + k] * M_[n * g + first + k];
        }
  }
  return out;
}

/// C - G_a M_b - (G_b M_a)^T + G_a N G_b^T, rows of a x rows of b.
void InverseNormal::into_gauge(const InGauge& a, const InGauge& b, double* C) const {
  const std::size_t d = gauge_.count();
  if (d == 0) return;
  const std::size_t rows = a.G.size() / d, columns = b.G.size() / d;
  std::vector<double> GN(rows * d, 0);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t l = 0; l < d; ++l)
      for (std::size_t k = 0; k < d; ++k) GN[d * i + l] += a.G[d * i + k] * N_[d * k + l];
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < columns; ++j)
      for (std::size_t k = 0; k < d; ++k)
        C[columns * i + j] += GN[d * i + k] * b.G[d * j + k] -
                              a.G[d * i + k] * b.M[columns * k + j] -
                              a.M[rows * k + i] * b.G[d * j + k];
}

void InverseNormal::solve_functions(SparseCholesky& cholesky) {
  const ParameterBlocks& blocks = equations_.blocks();
  const std::size_t n = is_pinned_.size();
  for (const LinearFunction& function : functions_) {
    std::vector<double>& X = solved_.emplace_back(n * function.rows, 0);
    for (const LinearPart& part : function.parts)
      for (std::size_t i = 0; i < function.rows; ++i)
        for (std::size_t k = 0; k < blocks.width(part.block); ++k)
          X[n * i + static_cast<std::size_t>(blocks.first[part.block]) + k] +=
              part.by[blocks.width(part.block) * i + k];
    for (std::size_t i = 0; i < function.rows; ++i) {
      poll_cancelled();
      for (const std::int32_t c : pinned_) X[n * i + static_cast<std::size_t>(c)] = 0;
      cholesky.solve(&X[n * i]);
      for (const std::int32_t c : pinned_) X[n * i + static_cast<std::size_t>(c)] = 0;
    }
  }
}

std::vector<double> InverseNormal::across(std::size_t a, std::size_t b) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const std::size_t n = is_pinned_.size();
  const std::size_t rows = functions_[a].rows, columns = functions_[b].rows;
  std::vector<double> C(rows * columns, 0);
  for (const LinearPart& part : functions_[b].parts) {
    const std::size_t width = blocks.width(part.block);
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < columns; ++j)
        for (std::size_t k = 0; k < width; ++k)
          C[columns * i + j] +=
              solved_[a][n * i + static_cast<std::size_t>(blocks.first[part.block]) + k] *
              part.by[width * j + k];
  }
  into_gauge(in_gauge(functions_[a]), in_gauge(functions_[b]), C.data());
  return C;
}

void InverseNormal::take_inverse(const SparseCholesky& cholesky) {
  const ParameterBlocks& blocks = equations_.blocks();
  BlockTiles& tiles = equations_.tiles();
  const double* panels = cholesky.panels();
  for (std::uint64_t t = 0; t < tiles.size(); ++t) {
    if (t % kTiles == 0) poll_cancelled();
    const std::uint32_t a = tiles.row(t), b = tiles.column(t);
    double* to = tiles.at(t);
    for (std::int32_t r = blocks.first[a]; r < blocks.first[a + 1]; ++r)
      for (std::int32_t c = blocks.first[b]; c < (a == b ? r + 1 : blocks.first[b + 1]); ++c) {
        const bool pinned = is_pinned_[static_cast<std::size_t>(r)] != 0 ||
                            is_pinned_[static_cast<std::size_t>(c)] != 0;
        const double value = pinned ? 0 : panels[cholesky.offset(r, c)];
        const std::int32_t i = r - blocks.first[a], k = c - blocks.first[b];
        to[9 * i + k] = value;
        if (a == b) to[9 * k + i] = value;
      }
  }
  const double limit = ridged_ ? kRidged / kRidge : kHopeless;
  for (std::uint32_t b = 0; b < blocks.count(); ++b)
    for (std::int32_t c = blocks.first[b]; c < blocks.first[b + 1]; ++c) {
      const std::size_t k = static_cast<std::size_t>(c - blocks.first[b]);
      const double square = equations_.squares()[static_cast<std::size_t>(c)];
      if (!(square > 0) || !(tiles.of(b, b)[10 * k] * square < limit))
        undetermined_[static_cast<std::size_t>(c)] = 1;
    }
}

Result<std::unique_ptr<InverseNormal>> InverseNormal::make(
    const Problem& problem, NormalEquations& equations, const SceneGauge& gauge,
    const GaugeWeights& weights, std::vector<LinearFunction> functions,
    std::uint64_t memory_limit_bytes, Threads& threads) {
  std::unique_ptr<InverseNormal> out(new InverseNormal(equations, gauge));
  out->functions_ = std::move(functions);
  const ParameterBlocks& blocks = equations.blocks();
  const auto n = static_cast<std::size_t>(blocks.columns());
  out->is_pinned_.assign(n, 0);
  out->undetermined_.assign(n, 0);
  out->pinned_ = gauge.minimal_constraints(equations.squares());
  for (std::size_t c = 0; c < n; ++c)
    if (!(equations.squares()[c] > 0)) out->pinned_.push_back(static_cast<std::int32_t>(c));
  for (const std::int32_t c : out->pinned_) out->is_pinned_[static_cast<std::size_t>(c)] = 1;
  if (n == 0) return out;
  std::vector<Tile> pattern;
  for (std::uint64_t t = 0; t < equations.tiles().size(); ++t)
    if (equations.tiles().row(t) != equations.tiles().column(t))
      pattern.push_back({equations.tiles().row(t), equations.tiles().column(t)});
  poll_cancelled();
  const auto analysis = analyse_columns(blocks.as_columns(), pattern);
  const std::uint64_t needed = peak_resident_bytes() + SparseCholesky::bytes(analysis->symbolic) +
                               SparseCholesky::invert_bytes(analysis->symbolic);
  if (memory_limit_bytes > 0 && needed > memory_limit_bytes)
    return Error(ErrorCode::memory_limit, "the covariance would need " + megabytes(needed) +
                                              ", the limit is " + as_given(memory_limit_bytes));
  poll_cancelled();
  SparseCholesky cholesky({analysis, &analysis->symbolic}, available_kernels().front()->name);
  if (!out->factor(cholesky, 0, threads)) {
    out->ridged_ = true;
    if (!out->factor(cholesky, kRidge, threads))
      return Error(
          ErrorCode::usage,
          "the normal equations are not positive definite: the state is no optimum, or its "
          "numbers are not finite");
  }
  out->solve_gauge(problem, weights, cholesky);
  out->solve_functions(cholesky);
  cholesky.invert(threads);
  out->take_inverse(cholesky);
  return out;
}

std::vector<double> InverseNormal::of(const LinearFunction& function) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const std::size_t rows = function.rows;
  std::vector<double> C(rows * rows, 0), half;
  for (const LinearPart& a : function.parts) {
    const std::size_t wa = blocks.width(a.block);
    for (const LinearPart& b : function.parts) {
      const std::size_t wb = blocks.width(b.block);
      bool transposed = false;
      const double* Z = tile(a.block, b.block, transposed);
      half.assign(rows * wb, 0);
      for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t l = 0; l < wb; ++l)
          for (std::size_t k = 0; k < wa; ++k)
            half[wb * i + l] += a.by[wa * i + k] * (transposed ? Z[9 * l + k] : Z[9 * k + l]);
      for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t j = 0; j < rows; ++j)
          for (std::size_t l = 0; l < wb; ++l)
            C[rows * i + j] += half[wb * i + l] * b.by[wb * j + l];
    }
  }
  const InGauge own = in_gauge(function);
  into_gauge(own, own, C.data());
  return C;
}

/// V^-1 + V^-1 W^T Z W V^-1, in the gauge.
std::array<double, 9> InverseNormal::of(const NormalEquations::Point& point,
                                        const double* X) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const BlockTiles& tiles = equations_.tiles();
  // The lower triangle of blocks, half of the diagonal ones, each of the nine entries of W^T Z W as
  // nine summands.
  std::array<double, 81> lanes{};
  tiles.for_pairs(point.blocks, [&](std::size_t at, std::size_t a, std::size_t b) {
    const double *Z = tiles.at(at), *left = point.W[a].data(), *right = point.W[b].data();
    const std::size_t rows = blocks.width(point.blocks[a]);
    std::array<double, 27> WZ{};
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t c = 0; c < 9; ++c) WZ[9 * i + c] += left[9 * i + r] * Z[9 * r + c];
    if (a == b)
      for (double& x : WZ) x *= 0.5;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 9; ++c)
          lanes[9 * (3 * i + k) + c] += WZ[9 * i + c] * right[9 * k + c];
  });
  std::array<double, 9> lower{}, middle;
  for (std::size_t e = 0; e < 9; ++e)
    for (std::size_t c = 0; c < 9; ++c) lower[e] += lanes[9 * e + c];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) middle[3 * i + k] = lower[3 * i + k] + lower[3 * k + i];
  std::array<double, 9> half{}, out = point.inverse;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l)
        half[3 * i + k] += point.inverse[3 * i + l] * middle[3 * l + k];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t l = 0; l < 3; ++l)
        out[3 * i + k] += half[3 * i + l] * point.inverse[3 * l + k];
  if (gauge_.count() == 0) return out;
  InGauge own{std::vector<double>(3 * gauge_.count()), of_point_gauge(point, X)};
  gauge_.of_point(X, own.G.data());
  into_gauge(own, own, out.data());
  return out;
}

/// With E_b = J_b - J_p V^-1 W_b^T: J_p V^-1 J_p^T + E Z E^T over the blocks of the point.
std::array<double, 4> InverseNormal::of_fit(const NormalEquations::Point& point,
                                            const ObservationRows::Row& row,
                                            bool points_held) const {
  const ParameterBlocks& blocks = equations_.blocks();
  std::array<double, 4> out{};
  std::array<double, 6> JV{};  // J_p V^-1
  if (!points_held && point.seen)
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l)
          JV[3 * r + k] += row.point[3 * r + l] * point.inverse[3 * l + k];
  for (std::size_t r = 0; r < 2; ++r)
    for (std::size_t s = 0; s < 2; ++s)
      for (std::size_t k = 0; k < 3; ++k) out[2 * r + s] += JV[3 * r + k] * row.point[3 * s + k];
  std::vector<std::array<double, 18>> E(point.blocks.size());
  for (std::size_t b = 0; b < point.blocks.size(); ++b) {
    E[b].fill(0);
    for (std::size_t k = 0; k < row.count; ++k)
      if (row.parts[k].block == point.blocks[b])
        for (std::size_t i = 0; i < 18; ++i) E[b][i] += row.parts[k].J[i];
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t c = 0; c < blocks.width(point.blocks[b]); ++c)
        for (std::size_t k = 0; k < 3; ++k)
          E[b][9 * r + c] -= JV[3 * r + k] * point.W[b][9 * k + c];
  }
  for (std::size_t a = 0; a < E.size(); ++a)
    for (std::size_t b = 0; b <= a; ++b) {
      const double* Z = equations_.tiles().of(point.blocks[a], point.blocks[b]);
      std::array<double, 4> sum{};
      for (std::size_t i = 0; i < blocks.width(point.blocks[a]); ++i)
        for (std::size_t k = 0; k < blocks.width(point.blocks[b]); ++k)
          for (std::size_t r = 0; r < 2; ++r)
            for (std::size_t s = 0; s < 2; ++s)
              sum[2 * r + s] += E[a][9 * r + i] * Z[9 * i + k] * E[b][9 * s + k];
      for (std::size_t r = 0; r < 2; ++r)
        for (std::size_t s = 0; s < 2; ++s)
          out[2 * r + s] += a == b ? sum[2 * r + s] : sum[2 * r + s] + sum[2 * s + r];
    }
  return out;
}

}  // namespace sheaf
