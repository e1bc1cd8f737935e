// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/block_ordering.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <utility>

namespace sheaf {
namespace {

using Edge = std::pair<std::int32_t, std::int32_t>;

/// Columns by node. A column of one image belongs to that image's node; columns of several, to the
/// node of the first image they serve.
void number_nodes(const Columns& columns, ColumnGraph& graph) {
  const auto count = static_cast<std::size_t>(columns.count);
  std::vector<std::int32_t> first_image(count, -1);
  std::vector<char> shared(count, false);
  for (std::size_t i = 0; i < columns.num_images(); ++i)
    for (int k = 0; k < 9; ++k)
      if (const std::int32_t c = columns.image(i)[k]; c >= 0) {
        shared[c] = first_image[c] >= 0;
        if (first_image[c] < 0) first_image[c] = static_cast<std::int32_t>(i);
      }
  std::vector<std::int32_t> node(2 * columns.num_images(), -1);
  graph.of_column.resize(count);
  graph.first.assign(1, 0);
  for (std::size_t c = 0; c < count; ++c) {
    std::int32_t& mine = node[2 * std::size_t(first_image[c]) + shared[c]];
    if (mine < 0) {
      mine = static_cast<std::int32_t>(graph.first.size() - 1);
      graph.first.push_back(0);
    }
    graph.of_column[c] = mine;
    ++graph.first[mine + 1];
  }
  for (std::size_t i = 1; i < graph.first.size(); ++i) graph.first[i] += graph.first[i - 1];
  graph.columns.resize(count);
  std::vector<std::int32_t> next(graph.first.begin(), graph.first.end() - 1);
  for (std::size_t c = 0; c < count; ++c)
    graph.columns[next[graph.of_column[c]]++] = static_cast<std::int32_t>(c);
}

/// Stable, by one end.
template <class Key>
void sort_by(const Key& key, std::size_t nodes, std::vector<Edge>& edges,
             std::vector<Edge>& scratch) {
  std::vector<std::uint64_t> next(nodes + 1, 0);
  for (const Edge& e : edges) ++next[key(e) + 1];
  for (std::size_t i = 1; i <= nodes; ++i) next[i] += next[i - 1];
  scratch.resize(edges.size());
  for (const Edge& e : edges) scratch[next[key(e)]++] = e;
  edges.swap(scratch);
}

/// The nodes of an image, each once; at most nine.
struct ImageNodes {
  std::int32_t node[9];
  int count = 0;
};

ImageNodes nodes_of(const Columns& columns, const ColumnGraph& graph, std::size_t image) {
  ImageNodes out;
  for (int k = 0; k < 9; ++k)
    if (const std::int32_t c = columns.image(image)[k]; c >= 0) {
      const std::int32_t n = graph.of_column[c];
      if (std::find(out.node, out.node + out.count, n) == out.node + out.count)
        out.node[out.count++] = n;
    }
  return out;
}

}  // namespace

ColumnGraph build_column_graph(const Columns& columns, const std::vector<Tile>& tiles) {
  ColumnGraph graph;
  number_nodes(columns, graph);
  std::vector<ImageNodes> images(columns.num_images());
  std::vector<Edge> edges, scratch;
  edges.reserve(2 * tiles.size());
  const auto couple = [&](const ImageNodes& a, const ImageNodes& b) {
    for (int i = 0; i < a.count; ++i)
      for (int j = 0; j < b.count; ++j)
        if (a.node[i] != b.node[j]) {
          edges.emplace_back(a.node[i], b.node[j]);
          edges.emplace_back(b.node[j], a.node[i]);
        }
  };
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i] = nodes_of(columns, graph, i);
    if (images[i].count > 1) couple(images[i], images[i]);
  }
  for (const Tile& tile : tiles) couple(images[tile.row], images[tile.column]);
  sort_by([](const Edge& e) { return e.second; }, graph.num_nodes(), edges, scratch);
  sort_by([](const Edge& e) { return e.first; }, graph.num_nodes(), edges, scratch);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  graph.first_neighbour.assign(graph.num_nodes() + 1, 0);
  graph.neighbours.reserve(edges.size());
  for (const Edge& e : edges) {
    ++graph.first_neighbour[e.first + 1];
    graph.neighbours.push_back(e.second);
  }
  for (std::size_t i = 1; i < graph.first_neighbour.size(); ++i)
    graph.first_neighbour[i] += graph.first_neighbour[i - 1];
  return graph;
}

std::vector<std::int32_t> order_nodes(const ColumnGraph& graph) {
  const auto n = static_cast<int>(graph.num_nodes());
  if (n == 0) return {};
  // Only the pattern is read; a node without its diagonal entry would count as a dense one.
  Eigen::SparseMatrix<char, Eigen::ColMajor, int> pattern(n, n);
  pattern.resizeNonZeros(static_cast<Eigen::Index>(graph.neighbours.size()) + n);
  int* to = pattern.innerIndexPtr();
  for (int i = 0; i < n; ++i) {
    pattern.outerIndexPtr()[i] = static_cast<int>(to - pattern.innerIndexPtr());
    const auto begin = graph.neighbours.begin() + std::ptrdiff_t(graph.first_neighbour[i]);
    const auto end = graph.neighbours.begin() + std::ptrdiff_t(graph.first_neighbour[i + 1]);
    const auto above = std::lower_bound(begin, end, i);
    to = std::copy(begin, above, to);
    *to++ = i;
    to = std::copy(above, end, to);
  }
  pattern.outerIndexPtr()[n] = static_cast<int>(to - pattern.innerIndexPtr());
  std::fill_n(pattern.valuePtr(), graph.neighbours.size() + std::size_t(n), char(0));
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order(n);
  Eigen::AMDOrdering<int>()(pattern.selfadjointView<Eigen::Lower>(), order);
  return {order.indices().data(), order.indices().data() + n};
}

}  // namespace sheaf
