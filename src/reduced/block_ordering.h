// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/chunks.h"
#include "lists/columns.h"

namespace sheaf {

/// The columns of the camera system in nodes that couple to others as a whole: an image's own
/// columns are one node, those of a lens that several images share another. Edges: nodes of one
/// image, and nodes of two images that share a tile.
struct ColumnGraph {
  std::vector<std::int32_t> of_column;  ///< node of each column
  std::vector<std::int32_t> columns;    ///< by node
  std::vector<std::int32_t> first;      ///< node i: columns[first[i]] to columns[first[i + 1]]

  std::vector<std::int32_t> neighbours;  ///< both ways, ascending, a node not among its own
  std::vector<std::uint64_t> first_neighbour;

  std::size_t num_nodes() const { return first.size() - 1; }
  std::int32_t weight(std::size_t node) const { return first[node + 1] - first[node]; }
};
ColumnGraph build_column_graph(const Columns& columns, const std::vector<Tile>& tiles);

/// An order of elimination of the nodes that keeps fill low: approximate minimum degree.
std::vector<std::int32_t> order_nodes(const ColumnGraph& graph);

}  // namespace sheaf
