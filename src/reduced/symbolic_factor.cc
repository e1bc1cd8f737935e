// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/symbolic_factor.h"

#include <algorithm>
#include <numeric>

namespace sheaf {
namespace {

using Index = std::int32_t;
using Indices = std::vector<Index>;

/// Parent of each position in the elimination tree of the graph in this order.
Indices elimination_tree(const ColumnGraph& graph, const Indices& order, const Indices& place) {
  Indices parent(order.size(), -1), ancestor(order.size(), -1);
  for (Index j = 0; j < static_cast<Index>(order.size()); ++j)
    for (std::uint64_t e = graph.first_neighbour[order[j]]; e < graph.first_neighbour[order[j] + 1];
         ++e)
      for (Index i = place[graph.neighbours[e]]; i >= 0 && i < j;) {
        const Index up = ancestor[i];
        ancestor[i] = j;
        if (up < 0) parent[i] = j;
        i = up;
      }
  return parent;
}

/// Children before parents, each subtree contiguous.
Indices postorder(const Indices& parent) {
  const auto n = static_cast<Index>(parent.size());
  Indices child(n + 1, -1), sibling(n, -1), out;
  for (Index j = n; j-- > 0;) {
    Index& head = child[parent[j] < 0 ? n : parent[j]];
    sibling[j] = head;
    head = j;
  }
  out.reserve(n);
  Indices stack;
  for (Index root = child[n]; root >= 0; root = sibling[root]) {
    stack.push_back(root);
    while (!stack.empty()) {
      const Index top = stack.back();
      if (const Index next = child[top]; next >= 0) {
        child[top] = sibling[next];
        stack.push_back(next);
      } else {
        out.push_back(top);
        stack.pop_back();
      }
    }
  }
  return out;
}

Indices inverse_of(const Indices& order) {
  Indices place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<Index>(k);
  return place;
}

/// Nodes eliminated together, by their places; rows: the places of the nodes below.
struct Group {
  Indices nodes, rows;
  double width = 0, below = 0;  ///< in columns
  Index parent = -1;
};

double flops_of(double w, double u) { return w * w * w / 3 + w * w * u + w * u * u; }

/// A model of the seconds that a supernode costs: its flops, its product's way to the ancestors,
/// and a start. What it compares, measured: 60 flops and one entry added to an ancestor a ns.
double cost_of(double w, double u) { return 1e-9 * (flops_of(w, u) / 60 + u * u / 2) + 2e-6; }

struct Elimination {
  std::vector<Group> groups;
  Indices group_of;  ///< of each place
};

/// The rows of each place, merged from its children's; a place whose rows are a child's less itself
/// joins the child's group.
Elimination eliminate(const ColumnGraph& graph, const Indices& order, const Indices& place,
                      const Indices& parent) {
  const auto n = static_cast<Index>(order.size());
  Elimination out;
  out.group_of.assign(n, -1);
  std::vector<Indices> children(n);
  for (Index j = 0; j < n; ++j)
    if (parent[j] >= 0) children[parent[j]].push_back(j);
  const auto weight = [&](const Indices& nodes) {
    double sum = 0;
    for (Index j : nodes) sum += graph.weight(order[j]);
    return sum;
  };
  Indices marked(n, -1), rows;
  for (Index j = 0; j < n; ++j) {
    rows.clear();
    const auto take = [&](Index i) {
      if (i <= j || marked[i] == j) return;
      marked[i] = j;
      rows.push_back(i);
    };
    for (Index c : children[j])
      for (Index i : out.groups[out.group_of[c]].rows) take(i);
    for (std::uint64_t e = graph.first_neighbour[order[j]]; e < graph.first_neighbour[order[j] + 1];
         ++e)
      take(place[graph.neighbours[e]]);
    Index joined = -1;
    for (Index c : children[j])
      if (joined < 0 && out.groups[out.group_of[c]].rows.size() == rows.size() + 1)
        joined = out.group_of[c];
    if (joined < 0) {
      joined = static_cast<Index>(out.groups.size());
      out.groups.emplace_back();
    }
    Group& group = out.groups[joined];
    group.nodes.push_back(j);
    group.rows = rows;
    group.width += graph.weight(order[j]);
    group.below = weight(rows);
    out.group_of[j] = joined;
  }
  for (Group& group : out.groups)
    if (parent[group.nodes.back()] >= 0) group.parent = out.group_of[parent[group.nodes.back()]];
  return out;
}

/// Joins groups to their parents where the zeros this stores cost less than what it saves.
void merge_groups(Elimination& e) {
  std::vector<Index> turn(e.groups.size());
  std::iota(turn.begin(), turn.end(), 0);
  std::sort(turn.begin(), turn.end(),
            [&](Index a, Index b) { return e.groups[a].nodes.back() < e.groups[b].nodes.back(); });
  // Parents come later in turn, so a group's parent has not been joined to another yet.
  for (Index g : turn) {
    Group& group = e.groups[g];
    if (group.parent < 0) continue;
    Group& parent = e.groups[group.parent];
    if (cost_of(group.width + parent.width, parent.below) >=
        cost_of(group.width, group.below) + cost_of(parent.width, parent.below))
      continue;
    parent.nodes.insert(parent.nodes.end(), group.nodes.begin(), group.nodes.end());
    parent.width += group.width;
    group.nodes.clear();
  }
  // A group joined to its parent leaves its children there.
  for (std::size_t t = turn.size(); t-- > 0;) {
    Group& group = e.groups[turn[t]];
    if (group.parent >= 0 && e.groups[group.parent].nodes.empty())
      group.parent = e.groups[group.parent].parent;
  }
}

/// The groups that are left, children first; `place` of the groups' parents in that order.
std::vector<Group> arrange_groups(Elimination e) {
  Indices kept(e.groups.size(), -1);
  std::vector<Group> groups;
  for (std::size_t g = 0; g < e.groups.size(); ++g)
    if (!e.groups[g].nodes.empty()) {
      kept[g] = static_cast<Index>(groups.size());
      groups.push_back(std::move(e.groups[g]));
    }
  Indices parent(groups.size());
  for (std::size_t g = 0; g < groups.size(); ++g)
    parent[g] = groups[g].parent < 0 ? -1 : kept[groups[g].parent];
  const Indices order = postorder(parent), place = inverse_of(order);
  std::vector<Group> out;
  for (Index g : order) {
    out.push_back(std::move(groups[g]));
    out.back().parent = parent[g] < 0 ? -1 : place[parent[g]];
    std::sort(out.back().nodes.begin(), out.back().nodes.end());
  }
  return out;
}

void lay_out(Supernode& s, SymbolicFactor& out) {
  s.top = (static_cast<std::size_t>(s.width) + 7) / 8 * 8;
  s.lda = s.rows_end();
  if (s.lda % 512 == 0) s.lda += 8;  // columns 4 KiB apart would share cache sets
  s.panel = out.panel_doubles;
  out.panel_doubles += s.lda * static_cast<std::size_t>(s.width);
  const auto w = static_cast<std::uint64_t>(s.width), u = static_cast<std::uint64_t>(s.below);
  out.entries += w * (w + 1) / 2 + w * u;
  out.flops += flops_of(s.width, s.below);
}

/// A group's columns as supernodes of about equal width, cut between nodes, each the parent of the
/// one before.
void add_pieces(Index first, const Indices& weights, const Indices& rows, SymbolicFactor& out) {
  const Index width = std::accumulate(weights.begin(), weights.end(), 0);
  const Index count = (width + SymbolicFactor::kWidest - 9) / (SymbolicFactor::kWidest - 8);
  const Index equal = std::min(SymbolicFactor::kWidest, (width + count - 1) / count + 8);
  std::size_t node = 0;
  for (Index done = 0; done < width;) {
    Supernode s{};
    s.first = first + done;
    while (node < weights.size() && (s.width == 0 || s.width + weights[node] <= equal))
      s.width += weights[node++];
    done += s.width;
    s.parent = static_cast<Index>(out.supernodes.size()) + 1;
    s.first_row = out.rows.size();
    for (Index p = first + done; p < first + width; ++p) out.rows.push_back(p);
    out.rows.insert(out.rows.end(), rows.begin(), rows.end());
    s.below = static_cast<Index>(out.rows.size() - s.first_row);
    std::fill_n(out.owner.begin() + s.first, s.width, static_cast<Index>(out.supernodes.size()));
    lay_out(s, out);
    out.supernodes.push_back(s);
  }
}

}  // namespace

SymbolicFactor analyse(const ColumnGraph& graph) {
  Indices order = order_nodes(graph);
  {
    const Indices tree = elimination_tree(graph, order, inverse_of(order));
    Indices better(order.size());
    const Indices post = postorder(tree);
    for (std::size_t k = 0; k < post.size(); ++k) better[k] = order[post[k]];
    order.swap(better);
  }
  const Indices place = inverse_of(order);
  Elimination elimination = eliminate(graph, order, place, elimination_tree(graph, order, place));
  merge_groups(elimination);
  const std::vector<Group> groups = arrange_groups(std::move(elimination));

  SymbolicFactor out;
  out.position.resize(graph.of_column.size());
  out.owner.resize(graph.of_column.size());
  Index next = 0;
  for (const Group& group : groups)
    for (Index j : group.nodes)
      for (Index c = graph.first[order[j]]; c < graph.first[order[j] + 1]; ++c)
        out.position[graph.columns[c]] = next++;
  Indices first_piece, rows, weights;
  next = 0;
  for (const Group& group : groups) {
    rows.clear();
    for (Index j : group.rows)
      for (Index c = graph.first[order[j]]; c < graph.first[order[j] + 1]; ++c)
        rows.push_back(out.position[graph.columns[c]]);
    std::sort(rows.begin(), rows.end());
    first_piece.push_back(static_cast<Index>(out.supernodes.size()));
    weights.clear();
    for (Index j : group.nodes) weights.push_back(graph.weight(order[j]));
    add_pieces(next, weights, rows, out);
    next += static_cast<Index>(group.width);
  }
  // The last piece of a group hangs below its parent's first.
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const std::size_t end =
        g + 1 < groups.size() ? std::size_t(first_piece[g + 1]) : out.supernodes.size();
    out.supernodes[end - 1].parent = groups[g].parent < 0 ? -1 : first_piece[groups[g].parent];
  }
  for (std::size_t s = 0; s < out.supernodes.size(); ++s)
    out.supernodes[s].subtree = static_cast<Index>(s);
  for (const Supernode& s : out.supernodes)
    if (s.parent >= 0) {
      Index& subtree = out.supernodes[s.parent].subtree;
      subtree = std::min(subtree, s.subtree);
    }
  return out;
}

std::uint64_t ColumnAnalysis::bytes() const {
  const auto size = [](const auto& v) { return v.size() * sizeof(v[0]); };
  return size(graph.of_column) + size(graph.columns) + size(graph.first) + size(symbolic.position) +
         size(symbolic.owner) + size(symbolic.supernodes) + size(symbolic.rows);
}

std::shared_ptr<const ColumnAnalysis> analyse_columns(const Columns& columns,
                                                      const std::vector<Tile>& tiles) {
  auto out = std::make_shared<ColumnAnalysis>();
  out->graph = build_column_graph(columns, tiles);
  out->symbolic = analyse(out->graph);
  std::vector<std::int32_t>().swap(out->graph.neighbours);
  std::vector<std::uint64_t>().swap(out->graph.first_neighbour);
  return out;
}

}  // namespace sheaf
