// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/block_fold.h"

#include <algorithm>

#include "geometry/motion_log.h"
#include "lists/block_layout.h"

namespace sheaf {
namespace {

constexpr int kPose = 6, kStride = static_cast<int>(Adjoint::kStride);

/// Rows and columns of a block, eight apart; the ninth of each beside them.
struct Product {
  double x[9][9];
};

bool is_pose(const BlockPart& part) { return part.first == 0 && part.count == kPose; }

/// M_a^T B M_b; entry(r, k) reads B.
template <class Entry>
void multiply_parts(const BlockPart& a, const BlockPart& b, const Adjoints& adjoints,
                    const Entry& entry, Product& out) {
  const int rows = a.count, columns = b.count;
  double B[9][9];
  for (int r = 0; r < rows; ++r)
    for (int k = 0; k < columns; ++k) B[r][k] = entry(a.first + r, b.first + k);
  if (b.sensor != BlockPart::kIdentity) {
    const Adjoint& M = adjoints[static_cast<std::size_t>(b.sensor)];
    for (int r = 0; r < rows; ++r) {
      double row[kPose] = {};
      for (std::size_t q = 0; q < kPose; ++q)
        for (std::size_t k = 0; k < kPose; ++k) row[k] += B[r][q] * M(q, k);
      std::copy_n(row, kPose, B[r]);
    }
  }
  if (a.sensor == BlockPart::kIdentity) {
    for (int r = 0; r < rows; ++r) std::copy_n(B[r], columns, out.x[r]);
    return;
  }
  const Adjoint& M = adjoints[static_cast<std::size_t>(a.sensor)];
  for (std::size_t r = 0; r < kPose; ++r) {
    std::fill_n(out.x[r], columns, 0.0);
    for (std::size_t q = 0; q < kPose; ++q)
      for (int k = 0; k < columns; ++k) out.x[r][k] += M(q, r) * B[q][k];
  }
}

/// The block's lower triangle of a symmetric sum, as the layout of diagonal blocks stores it.
void add_to_block(const double (&sum)[9][9], double* block) {
  for (int r = 0; r < 9; ++r)
    for (int k = 0; k < 9; ++k)
      if (diagonal_layout::is_stored(r, k)) block[diagonal_layout::at(r, k)] += sum[r][k];
}

/// M^T x of a right-hand side; of the columns' squares, with those of M's entries.
void add_vectors(const BlockPart& part, const Adjoints& adjoints, const double* from, double* to) {
  const auto square_of = [from](int k) {
    return diagonal_entry(from, k, k) + from[diagonal_layout::squares(k)];
  };
  for (int r = 0; r < part.count; ++r) {
    const int at = part.first + r;
    double right = 0, square = 0;
    if (part.sensor == BlockPart::kIdentity) {
      right = from[diagonal_layout::right_side(at)];
      square = square_of(at);
    } else {
      const Adjoint& M = adjoints[static_cast<std::size_t>(part.sensor)];
      for (int q = 0; q < kPose; ++q) {
        const double m = M(static_cast<std::size_t>(q), static_cast<std::size_t>(r));
        right += m * from[diagonal_layout::right_side(q)];
        square += m * m * square_of(q);
      }
    }
    to[diagonal_layout::right_side(at)] += right;
    to[diagonal_layout::squares(at)] += square;
  }
}

}  // namespace

void adjoints_of(const CameraState& cameras, Adjoints& out) {
  out.clear();
  for (const RigidMotion<double>& sensor : cameras.sensors) {
    const std::array<double, 36> A = adjoint_of(sensor);
    Adjoint& to = out.emplace_back();
    for (std::size_t r = 0; r < kPose; ++r)
      std::copy_n(&A[kPose * r], kPose, &to.at[Adjoint::kStride * r]);
  }
}

Adjoints adjoints_of(const CameraState& cameras) {
  Adjoints out;
  adjoints_of(cameras, out);
  return out;
}

void to_rows(const BlockMap& map, const Adjoints& adjoints, const double* solved, double* rows) {
  std::fill_n(rows, kBlockVector * map.row_blocks(), 0.0);
  for (std::size_t i = 0; i < map.row_blocks(); ++i)
    for (const BlockPart* part = map.begin(i); part != map.end(i); ++part) {
      const double* x = solved + kBlockVector * part->block;
      double* to = rows + kBlockVector * i;
      if (part->sensor == BlockPart::kIdentity) {
        for (int k = part->first; k < part->first + part->count; ++k) to[k] += x[k];
        continue;
      }
      const Adjoint& M = adjoints[static_cast<std::size_t>(part->sensor)];
      for (std::size_t r = 0; r < kPose; ++r)
        for (std::size_t k = 0; k < kPose; ++k) to[r] += M(r, k) * x[k];
    }
}

void to_solved(const BlockMap& map, const Adjoints& adjoints, const double* rows, double* solved) {
  std::fill_n(solved, kBlockVector * map.columns.num_images(), 0.0);
  for (std::size_t i = 0; i < map.row_blocks(); ++i)
    for (const BlockPart* part = map.begin(i); part != map.end(i); ++part) {
      const double* y = rows + kBlockVector * i;
      double* to = solved + kBlockVector * part->block;
      if (part->sensor == BlockPart::kIdentity) {
        for (int k = part->first; k < part->first + part->count; ++k) to[k] += y[k];
        continue;
      }
      const Adjoint& M = adjoints[static_cast<std::size_t>(part->sensor)];
      for (std::size_t r = 0; r < kPose; ++r)
        for (std::size_t k = 0; k < kPose; ++k) to[k] += M(r, k) * y[r];
    }
}

BlockFold::BlockFold(const BlockMap& map, const std::vector<Tile>& row_tiles, bool with_tiles,
                     const char* simd_name, Threads& threads)
    : map_(map),
      products_(pose_products(simd_name)),
      threads_(threads),
      row_tiles_(static_cast<std::uint32_t>(row_tiles.size())) {
  if (with_tiles) tiles_ = map.solved_tiles(row_tiles);
  list_pieces(row_tiles, with_tiles);
  tile_sums_.allocate(kTileDoubles * tiles_.size());
  diagonal_.allocate(kDiagonalDoubles * map.columns.num_images());
}

void BlockFold::list_pieces(const std::vector<Tile>& row_tiles, bool with_tiles) {
  const auto number_of = [&](std::uint32_t a, std::uint32_t b) {
    const Tile wanted{std::max(a, b), std::min(a, b)};
    const auto found =
        std::lower_bound(tiles_.begin(), tiles_.end(), wanted, [](const Tile& x, const Tile& y) {
          return x.row != y.row ? x.row < y.row : x.column < y.column;
        });
    return static_cast<std::size_t>(found - tiles_.begin());
  };
  std::vector<std::pair<std::uint64_t, Piece>> all;
  const auto add = [&](std::uint32_t from, std::uint32_t a, std::uint32_t b) {
    const std::uint32_t row = map_.parts[a].block, column = map_.parts[b].block;
    if (row == column)
      all.push_back({tiles_.size() + row, {from, a, b}});
    else if (with_tiles)
      all.push_back({number_of(row, column), {from, a, b}});
  };
  for (std::uint32_t t = 0; t < row_tiles.size(); ++t)
    for (std::uint32_t a = map_.first_part[row_tiles[t].row];
         a < map_.first_part[row_tiles[t].row + 1]; ++a)
      for (std::uint32_t b = map_.first_part[row_tiles[t].column];
           b < map_.first_part[row_tiles[t].column + 1]; ++b)
        add(t, a, b);
  for (std::uint32_t i = 0; i < map_.row_blocks(); ++i)
    for (std::uint32_t a = map_.first_part[i]; a < map_.first_part[i + 1]; ++a)
      for (std::uint32_t b = map_.first_part[i]; b <= a; ++b) add(row_tiles_ + i, a, b);
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  first_piece_.assign(tiles_.size() + map_.columns.num_images() + 1, 0);
  for (const auto& [target, piece] : all) {
    ++first_piece_[target + 1];
    pieces_.push_back(piece);
  }
  for (std::size_t t = 1; t < first_piece_.size(); ++t) first_piece_[t] += first_piece_[t - 1];
}

/// A solved tile is what S lacks of it: tiles of rows add to it, diagonal blocks are taken off.
/// Pieces of poses, nearly all there are, are summed apart: as they are, and those that are turned.
void BlockFold::fold_tile(std::size_t tile, const Adjoints& adjoints, const double* tiles,
                          const double* diagonal) {
  double* to = &tile_sums_[kTileDoubles * tile];
  std::fill_n(to, kTileDoubles, 0.0);
  alignas(64) double poses[2][kPoseMatrix] = {};
  const auto matrix = [&](const BlockPart& part) {
    const bool identity = part.sensor == BlockPart::kIdentity;
    return identity ? nullptr : adjoints[static_cast<std::size_t>(part.sensor)].at.data();
  };
  for (std::uint64_t p = first_piece_[tile]; p < first_piece_[tile + 1]; ++p) {
    const Piece& piece = pieces_[p];
    const BlockPart &a = map_.parts[piece.a], &b = map_.parts[piece.b];
    const bool is_tile = piece.from < row_tiles_, as_is = a.block == tiles_[tile].row;
    if (is_tile && is_pose(a) && is_pose(b)) {
      products_.add(matrix(a), tiles + kTileDoubles * piece.from, matrix(b), poses[as_is ? 0 : 1]);
      continue;
    }
    Product product;
    if (is_tile) {
      const double* from = tiles + kTileDoubles * piece.from;
      multiply_parts(
          a, b, adjoints, [&](int r, int k) { return tile_entry(from, r, k); }, product);
    } else {
      const double* from = diagonal + kDiagonalDoubles * (piece.from - row_tiles_);
      multiply_parts(
          a, b, adjoints, [&](int r, int k) { return -diagonal_entry(from, r, k); }, product);
    }
    for (int r = 0; r < a.count; ++r)
      for (int k = 0; k < b.count; ++k)
        to[as_is ? tile_layout::at(a.first + r, b.first + k)
                 : tile_layout::at(b.first + k, a.first + r)] += product.x[r][k];
  }
  for (int r = 0; r < kPose; ++r)
    for (int k = 0; k < kPose; ++k)
      to[tile_layout::at(r, k)] += poses[0][kStride * r + k] + poses[1][kStride * k + r];
}

/// Two parts of one block, in a tile or beside each other in a diagonal block, count both ways.
/// Squares come as what is missing on the diagonal to those of whole columns.
void BlockFold::fold_diagonal(std::size_t block, const Adjoints& adjoints, const double* tiles,
                              const double* diagonal) {
  double* to = &diagonal_[kDiagonalDoubles * block];
  std::fill_n(to, kDiagonalDoubles, 0.0);
  double sum[9][9] = {};
  const std::size_t target = tiles_.size() + block;
  for (std::uint64_t p = first_piece_[target]; p < first_piece_[target + 1]; ++p) {
    const Piece& piece = pieces_[p];
    const BlockPart &a = map_.parts[piece.a], &b = map_.parts[piece.b];
    const bool is_tile = piece.from < row_tiles_;
    Product product;
    const double* from = is_tile ? tiles + kTileDoubles * piece.from
                                 : diagonal + kDiagonalDoubles * (piece.from - row_tiles_);
    if (is_tile)
      multiply_parts(
          a, b, adjoints, [&](int r, int k) { return -tile_entry(from, r, k); }, product);
    else
      multiply_parts(
          a, b, adjoints, [&](int r, int k) { return diagonal_entry(from, r, k); }, product);
    const bool both = is_tile || piece.a != piece.b;
    for (int r = 0; r < a.count; ++r)
      for (int k = 0; k < b.count; ++k) {
        sum[a.first + r][b.first + k] += product.x[r][k];
        if (both) sum[b.first + k][a.first + r] += product.x[r][k];
      }
    if (!both) add_vectors(a, adjoints, from, to);
  }
  add_to_block(sum, to);
  for (int k = 0; k < 9; ++k) to[diagonal_layout::squares(k)] -= sum[k][k];
}

void BlockFold::fold(const Adjoints& adjoints, const double* tiles, const double* diagonal) {
  constexpr std::size_t kTargets = 64;
  threads_.for_ranges(first_piece_.size() - 1, kTargets, [&](std::size_t t, std::size_t end) {
    for (; t < end; ++t) {
      if (t < tiles_.size())
        fold_tile(t, adjoints, tiles, diagonal);
      else
        fold_diagonal(t - tiles_.size(), adjoints, tiles, diagonal);
    }
  });
}

std::uint64_t BlockFold::bytes() const {
  return tile_sums_.bytes() + diagonal_.bytes() + pieces_.size() * sizeof(Piece) +
         first_piece_.size() * 8 + tiles_.size() * sizeof(Tile);
}

}  // namespace sheaf
