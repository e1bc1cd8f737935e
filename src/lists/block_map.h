// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/chunks.h"
#include "lists/columns.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Columns first to first + count - 1 of a block of rows are M times the same columns of a solved
/// block. M is the identity or, of the six columns of a pose, the adjoint of a sensor.
struct BlockPart {
  static constexpr std::int32_t kIdentity = -1;
  std::uint32_t block;
  std::uint8_t first, count;
  std::int32_t sensor = kIdentity;
};

/// How the blocks that rows have sums of hang on the blocks that are solved for. An image of a rig
/// moves by its frame and its sensor: exp(d) S F = exp(d_S) S exp(d_F) F, so that d = d_S + Ad(S)
/// d_F. What kernels sum is by images, whatever these hang on; the map is applied to the sums.
struct BlockMap {
  std::vector<BlockPart> parts;
  std::vector<std::uint32_t> first_part;  ///< of each block of rows, and in all
  Columns columns;                        ///< of the solved blocks
  Columns coarse_columns;  ///< of images and frames alone: what the coarse space moves

  // Solved blocks, kNone: not there or held.
  static constexpr std::uint32_t kNone = 0xffffffff;
  std::vector<std::uint32_t> image_block;   ///< of each image of no rig, or of a trivial frame
  std::vector<std::uint32_t> frame_block;   ///< of each frame
  std::vector<std::uint32_t> sensor_block;  ///< of each sensor
  std::vector<std::uint32_t> moved_images;  ///< those whose pose is of a frame and a sensor
  /// Kept points: their solved blocks are the last ones, as their blocks of rows are.
  std::uint32_t first_kept = kNone, kept = 0;
  std::vector<Tile> term_tiles;  ///< of rows: what terms couple

  /// Solved columns by columns of rows, where these are the same; else kFixed.
  std::vector<std::int32_t> solved_column;

  /// Of each image of the rows, the solved block that it moves with as the coarse space sees it.
  std::vector<std::uint32_t> coarse_block() const;

  std::size_t row_blocks() const { return first_part.size() - 1; }
  const BlockPart* begin(std::size_t block) const { return &parts[0] + first_part[block]; }
  const BlockPart* end(std::size_t block) const { return &parts[0] + first_part[block + 1]; }

  /// The solved tiles, row > column, that the diagonal blocks of the rows, the terms' tiles and
  /// these add to.
  std::vector<Tile> solved_tiles(const std::vector<Tile>& of_rows) const;
};

/// What of a problem's poses moves: of images, frames and sensors, 1 where it does.
struct MovingPoses {
  std::vector<std::uint8_t> images, frames, sensors;
};
/// A sensor is held where its rig has no image of a reference sensor, as nothing else would tell
/// frames and sensors apart.
MovingPoses moving_poses(const Problem& problem, const Fixed& fixed);

/// `fixed` as rows by images see it: an image of a rig is held where its frame and its sensor are.
Fixed fixed_images(const Problem& problem, const Fixed& fixed);

/// `columns`: of the rows' blocks, first the images', as fixed_images() leaves them free, the last
/// `kept` those of kept points. Each set of columns 6 to 8 that several images or images of rigs
/// have is a solved block of its own. restated: cameras are turned, so that reference sensors are
/// not the identity.
BlockMap map_blocks(const Problem& problem, const Fixed& fixed, const Columns& columns,
                    std::uint32_t kept, bool restated);

/// The columns, and three for each of `count` blocks of kept points behind them; none where these
/// are held.
Columns with_kept_points(const Columns& columns, std::uint32_t count, bool held);

}  // namespace sheaf
