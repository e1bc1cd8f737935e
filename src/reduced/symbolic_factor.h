// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "reduced/block_ordering.h"

namespace sheaf {

/// Consecutive columns of the factor with the same rows below them, stored as one dense panel,
/// column-major: rows 0 to width are the columns' own, rows top to top + below the others'.
struct Supernode {
  std::int32_t first, width, below;
  std::int32_t parent;      ///< -1 at a root
  std::int32_t subtree;     ///< the first supernode of its subtree, which is contiguous
  std::uint64_t first_row;  ///< positions of the rows below: rows[first_row] and on, ascending
  std::uint64_t panel;      ///< offset in doubles
  std::size_t top, lda;     ///< multiples of 8

  std::size_t rows_end() const { return (top + static_cast<std::size_t>(below) + 7) / 8 * 8; }
};

/// What the factor P A P^T = L L^T looks like: a pure function of the graph.
struct SymbolicFactor {
  /// Wider ones are cut: what a panel owes the next is then a product like any other.
  static constexpr std::int32_t kWidest = 256;

  std::vector<std::int32_t> position;  ///< of each column in the order of elimination
  std::vector<std::int32_t> owner;     ///< supernode of each position
  std::vector<Supernode> supernodes;   ///< children before parents
  std::vector<std::int32_t> rows;
  std::uint64_t panel_doubles = 0;
  std::uint64_t entries = 0;  ///< of the lower triangle, the zeros of merged supernodes included
  double flops = 0;

  std::size_t size() const { return position.size(); }
};
SymbolicFactor analyse(const ColumnGraph& graph);

/// Nodes and factor of a camera matrix: what a plan counts and a sparse solver works with.
struct ColumnAnalysis {
  ColumnGraph graph;  ///< its nodes; neighbours are known no more
  SymbolicFactor symbolic;

  std::uint64_t bytes() const;
};
std::shared_ptr<const ColumnAnalysis> analyse_columns(const Columns& columns,
                                                      const std::vector<Tile>& tiles);

}  // namespace sheaf
