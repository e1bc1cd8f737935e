// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <vector>

#include "reduced/camera_solver.h"
#include "reduced/sparse_cholesky.h"

namespace sheaf {
namespace {

/// Columns of an image that belong to one node, in the order they stand in there.
struct Part {
  std::int32_t node;
  std::int32_t count = 0;
  std::int8_t slot[9];  ///< which of the image's nine
};

/// The parts of each image.
struct Parts {
  std::vector<Part> parts;
  std::vector<std::uint32_t> first;

  Parts(const Columns& columns, const ColumnGraph& graph) : first(1, 0) {
    for (std::size_t i = 0; i < columns.num_images(); ++i) {
      for (int k = 0; k < 9; ++k)
        if (const std::int32_t c = columns.image(i)[k]; c >= 0) add(graph.of_column[c], k);
      first.push_back(static_cast<std::uint32_t>(parts.size()));
    }
  }

 private:
  void add(std::int32_t node, int slot) {
    std::size_t p = first.back();
    while (p < parts.size() && parts[p].node != node) ++p;
    if (p == parts.size()) parts.push_back({node, 0, {}});
    parts[p].slot[parts[p].count++] = static_cast<std::int8_t>(slot);
  }
};

/// One block's way into a panel: its rows' part and its columns' part, from a tile or, beyond the
/// tiles, from an image's diagonal block.
struct Piece {
  std::uint64_t to;    ///< in doubles from the panels
  std::uint32_t from;  ///< tile, or the number of tiles plus the image
  std::uint32_t rows, columns;
  bool transposed;  ///< the rows' part is of the tile's column image
};

/// S stored and factored by supernodes.
class SparseSolver : public CameraSolver {
 public:
  SparseSolver(const Columns& columns, const Chunks& chunks,
               const std::shared_ptr<const ColumnAnalysis>& analysis, const Kernels& kernels,
               Threads& threads)
      : tiles_(static_cast<std::uint32_t>(chunks.tiles.size())),
        threads_(threads),
        parts_(columns, analysis->graph),
        cholesky_({analysis, &analysis->symbolic}, kernels.name) {
    const SymbolicFactor& symbolic = cholesky_.symbolic();
    column_at_.resize(symbolic.size());
    for (std::size_t c = 0; c < symbolic.size(); ++c)
      column_at_[symbolic.position[c]] = static_cast<std::int32_t>(c);
    list_pieces(chunks, analysis->graph);
  }

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    const auto fill = [&](std::size_t s) {
      const Supernode& node = cholesky_.symbolic().supernodes[s];
      for (std::uint64_t p = first_piece_[s]; p < first_piece_[s + 1]; ++p)
        place(pieces_[p], system.sums, node.lda);
      double* A = cholesky_.panels() + node.panel;
      for (std::int32_t j = 0; j < node.width; ++j)
        A[j * node.lda + j] += system.damping[column_at_[node.first + j]];
    };
    if (!cholesky_.factor(threads_, fill, system.cancelled)) return {};
    std::copy(system.vectors->rhs.begin(), system.vectors->rhs.end(), x.begin());
    cholesky_.solve(x.data());
    return {true, 0};
  }

  std::uint64_t bytes() const override {
    return SparseCholesky::bytes(cholesky_.symbolic()) + pieces_.size() * sizeof(Piece) +
           parts_.parts.size() * sizeof(Part) + 4 * column_at_.size();
  }

 private:
  void list_pieces(const Chunks& chunks, const ColumnGraph& graph) {
    const SymbolicFactor& symbolic = cholesky_.symbolic();
    std::vector<Piece> pieces;
    std::vector<std::int32_t> owner;
    pieces.reserve(tiles_ + parts_.parts.size());  // exact where no image shares a lens
    owner.reserve(pieces.capacity());
    const auto couple = [&](std::uint32_t from, std::uint32_t a, std::uint32_t b) {
      const std::int32_t row = graph.columns[graph.first[parts_.parts[a].node]];
      const std::int32_t column = graph.columns[graph.first[parts_.parts[b].node]];
      const bool swap = symbolic.position[row] < symbolic.position[column];
      pieces.push_back({cholesky_.offset(row, column), from, swap ? b : a, swap ? a : b, swap});
      owner.push_back(symbolic.owner[std::min(symbolic.position[row], symbolic.position[column])]);
    };
    for (std::uint32_t t = 0; t < tiles_; ++t) {
      const Tile& tile = chunks.tiles[t];
      for (std::uint32_t a = parts_.first[tile.row]; a < parts_.first[tile.row + 1]; ++a)
        for (std::uint32_t b = parts_.first[tile.column]; b < parts_.first[tile.column + 1]; ++b)
          couple(t, a, b);
    }
    for (std::uint32_t i = 0; i + 1 < parts_.first.size(); ++i)
      for (std::uint32_t a = parts_.first[i]; a < parts_.first[i + 1]; ++a)
        for (std::uint32_t b = parts_.first[i]; b <= a; ++b) couple(tiles_ + i, a, b);
    sort_by_supernode(pieces, owner);
  }

  void sort_by_supernode(const std::vector<Piece>& pieces, const std::vector<std::int32_t>& owner) {
    first_piece_.assign(cholesky_.symbolic().supernodes.size() + 1, 0);
    for (std::int32_t s : owner) ++first_piece_[s + 1];
    for (std::size_t s = 1; s < first_piece_.size(); ++s) first_piece_[s] += first_piece_[s - 1];
    std::vector<std::uint64_t> next(first_piece_.begin(), first_piece_.end() - 1);
    pieces_.resize(pieces.size());
    for (std::size_t p = 0; p < pieces.size(); ++p) pieces_[next[owner[p]]++] = pieces[p];
  }

  /// Image blocks are added; tiles subtracted: S -= P + P^T with P = T_a T_b^T at the rows of one
  /// image and the columns of the other. Where both are the same node (a shared lens, a point seen
  /// twice) the block on the diagonal takes both terms.
  void place(const Piece& piece, const ReducedSums& sums, std::size_t lda) {
    const Part& rows = parts_.parts[piece.rows];
    const Part& columns = parts_.parts[piece.columns];
    double* to = cholesky_.panels() + piece.to;
    const bool on_diagonal = rows.node == columns.node;
    if (piece.from >= tiles_) {
      const double* block = sums.diagonal + kDiagonalDoubles * (piece.from - tiles_);
      for (int j = 0; j < columns.count; ++j)
        for (int i = on_diagonal ? j : 0; i < rows.count; ++i)
          to[j * lda + i] += diagonal_entry(block, rows.slot[i], columns.slot[j]);
      return;
    }
    const double* tile = sums.tiles + kTileDoubles * piece.from;
    if (!on_diagonal && rows.count == 9 && columns.count == 9)
      return piece.transposed ? place_transposed(tile, to, lda) : place_whole(tile, to, lda);
    for (int j = 0; j < columns.count; ++j)
      for (int i = on_diagonal ? j : 0; i < rows.count; ++i) {
        const int r = rows.slot[i], k = columns.slot[j];
        double value = piece.transposed ? tile_entry(tile, k, r) : tile_entry(tile, r, k);
        if (on_diagonal)
          value += piece.transposed ? tile_entry(tile, r, k) : tile_entry(tile, k, r);
        to[j * lda + i] -= value;
      }
  }
  static void place_whole(const double* tile, double* to, std::size_t lda) {
    for (int k = 0; k < 8; ++k) {
      for (int r = 0; r < 8; ++r) to[k * lda + r] -= tile_entry(tile, r, k);
      to[k * lda + 8] -= tile_entry(tile, 8, k);
    }
    for (int r = 0; r < 9; ++r) to[8 * lda + r] -= tile[tile_layout::kColumn8 + r];
  }
  static void place_transposed(const double* tile, double* to, std::size_t lda) {
    for (int r = 0; r < 9; ++r) {
      for (int k = 0; k < 8; ++k) to[r * lda + k] -= tile_entry(tile, r, k);
      to[r * lda + 8] -= tile[tile_layout::kColumn8 + r];
    }
  }

  std::uint32_t tiles_;
  Threads& threads_;
  Parts parts_;
  SparseCholesky cholesky_;
  std::vector<std::int32_t> column_at_;  ///< each position's
  std::vector<Piece> pieces_;            ///< by supernode
  std::vector<std::uint64_t> first_piece_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_sparse_solver(const Columns& columns, const Chunks& chunks,
                                                 const Kernels& kernels, Threads& threads,
                                                 std::shared_ptr<const ColumnAnalysis> analysis) {
  if (analysis == nullptr) analysis = analyse_columns(columns, chunks.tiles);
  return std::make_unique<SparseSolver>(columns, chunks, analysis, kernels, threads);
}

}  // namespace sheaf
