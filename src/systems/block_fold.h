// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "eliminate/pose_products.h"
#include "lists/block_map.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "systems/camera_state.h"

namespace sheaf {

/// The adjoint of each sensor, 6 x 6, row-major: [R, [t]x R; 0, R] for (rho, phi).
/// Rows are eight apart, so that they are as those of tiles.
struct alignas(64) Adjoint {
  static constexpr std::size_t kStride = 8;
  std::array<double, 6 * kStride> at{};
  double operator()(std::size_t row, std::size_t column) const {
    return at[kStride * row + column];
  }
};
using Adjoints = std::vector<Adjoint>;
Adjoints adjoints_of(const CameraState& cameras);
/// Allocates nothing where `out` had as many.
void adjoints_of(const CameraState& cameras, Adjoints& out);

/// kBlockVector doubles for each block of rows from those of the solved blocks, x_row = M x.
void to_rows(const BlockMap& map, const Adjoints& adjoints, const double* solved, double* rows);
/// And back: y = M^T y_row.
void to_solved(const BlockMap& map, const Adjoints& adjoints, const double* rows, double* solved);

/// Sums over blocks of rows to sums over the solved blocks, S = M^T S_rows M. Each solved block and
/// tile adds up its own pieces in a fixed order.
class BlockFold {
 public:
  /// row_tiles: of the sums over rows; with_tiles: whether solved tiles are wanted, too. The map
  /// must outlive it.
  BlockFold(const BlockMap& map, const std::vector<Tile>& row_tiles, bool with_tiles,
            const char* simd_name, Threads& threads);

  /// The solved tiles, in the layout of ReducedSums.
  const std::vector<Tile>& tiles() const { return tiles_; }
  const double* tile_sums() const { return tile_sums_.data(); }
  const double* diagonal() const { return diagonal_.data(); }

  /// tiles, diagonal: sums over rows. The square of a solved column, which scales its damping, is
  /// the sum over the columns of rows of those squares, each times that of M's entry.
  void fold(const Adjoints& adjoints, const double* tiles, const double* diagonal);
  std::uint64_t bytes() const;

 private:
  /// M_a^T B M_b of a tile or, from row_tiles_ on, of a diagonal block of rows.
  struct Piece {
    std::uint32_t from, a, b;  ///< a, b: parts of the tile's row and column
  };
  void list_pieces(const std::vector<Tile>& row_tiles, bool with_tiles);
  void fold_tile(std::size_t tile, const Adjoints& adjoints, const double* tiles,
                 const double* diagonal);
  void fold_diagonal(std::size_t block, const Adjoints& adjoints, const double* tiles,
                     const double* diagonal);

  const BlockMap& map_;
  const PoseProducts& products_;
  Threads& threads_;
  const std::uint32_t row_tiles_;
  std::vector<Tile> tiles_;
  std::vector<Piece> pieces_;  ///< of the solved tiles, then of the solved blocks
  std::vector<std::uint64_t> first_piece_;
  Buffer<double> tile_sums_, diagonal_;
};

}  // namespace sheaf
