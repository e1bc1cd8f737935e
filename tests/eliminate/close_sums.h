// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lists/block_layout.h"
#include "platform/buffer.h"

namespace sheaf::test {

/// The size of a column of a diagonal block: by its squares with and without points.
inline double column_size(const Buffer<double>& diagonal, std::size_t block, int column) {
  const double* d = &diagonal[kDiagonalDoubles * block];
  return std::sqrt(diagonal_entry(d, column, column) + d[diagonal_layout::squares(column)]);
}

/// Diagonal blocks entry by entry, each against the sizes of its row and its column; `residual` is
/// the size of all residuals.
inline void expect_same_diagonal(const Buffer<double>& got, const Buffer<double>& expected,
                                 double residual, double tolerance) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t b = 0; b < expected.size() / kDiagonalDoubles; ++b)
    for (int i = 0; i < 91; ++i) {
      const int row = i < 64 ? i / 8 : i < 72 ? 8 : i < 88 ? i % 8 : 8;
      const int column = i < 72 ? i % 8 : row;
      const bool right_side = (i >= 72 && i < 80) || i == 89;
      const double size = column_size(expected, b, row) *
                          (right_side ? residual : column_size(expected, b, column));
      const std::size_t at = kDiagonalDoubles * b + static_cast<std::size_t>(i);
      ASSERT_NEAR(got[at], expected[at], tolerance * size) << "block " << b << ", " << i;
    }
}

/// Tiles likewise, by the sizes of the columns of the diagonal blocks.
inline void expect_same_tiles(const Buffer<double>& got, const Buffer<double>& expected,
                              const std::vector<Tile>& tiles, const Buffer<double>& diagonal,
                              double tolerance) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (int i = 0; i < 81; ++i) {
      const int row = i < 64 ? i / 8 : i < 72 ? 8 : i < 80 ? i - 72 : 8;
      const int column = i < 72 ? i % 8 : 8;
      const double size =
          column_size(diagonal, tiles[t].row, row) * column_size(diagonal, tiles[t].column, column);
      const std::size_t at = kTileDoubles * t + static_cast<std::size_t>(i);
      ASSERT_NEAR(got[at], expected[at], tolerance * size)
          << "tile of " << tiles[t].row << " and " << tiles[t].column << ", " << i;
    }
}

/// Numbers of one kind, each against itself or a thousandth of the largest.
inline void expect_close(const Buffer<double>& got, const Buffer<double>& expected,
                         double tolerance, const std::string& what) {
  ASSERT_EQ(got.size(), expected.size());
  double scale = 0;
  for (double x : expected) scale = std::max(scale, std::abs(x));
  for (std::size_t i = 0; i < got.size(); ++i)
    ASSERT_NEAR(got[i], expected[i], tolerance * (std::abs(expected[i]) + 1e-3 * scale))
        << what << " " << i;
}

}  // namespace sheaf::test
