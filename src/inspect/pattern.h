// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "inspect/covisibility.h"
#include "sheaf/problem.h"

namespace sheaf {

/// One side of a matrix on pixels: bands of scalars, each with its own scale.
struct PatternAxis {
  struct Band {
    std::uint64_t begin = 0, end = 0;  ///< scalars
    int first_pixel = 0, pixels = 0;
  };
  std::vector<Band> bands;  ///< one after another, both in scalars and in pixels

  int pixels() const { return bands.back().first_pixel + bands.back().pixels; }
};

/// What part of each pixel's entries is not zero. Each entry must be added once.
class PatternGrid {
 public:
  PatternGrid(PatternAxis rows, PatternAxis columns);

  /// Entries of rows [r0, r1) and columns [c0, c1), each range within one band.
  void add(std::uint64_t r0, std::uint64_t r1, std::uint64_t c0, std::uint64_t c1);

  const PatternAxis& rows() const { return rows_; }
  const PatternAxis& columns() const { return columns_; }
  double density(int row, int column) const {
    return density_[std::size_t(row) * std::size_t(columns_.pixels()) + std::size_t(column)];
  }
  std::uint64_t nonzeros() const { return nonzeros_; }

 private:
  PatternAxis rows_, columns_;
  std::vector<double> density_;
  std::uint64_t nonzeros_ = 0;
};

/// Scalars of a problem's matrices: the camera side first (each image's pose and, where no lens is
/// shared, its lens: 9 columns; else 6 for each pose, then 3 for each lens), then the points.
struct PatternColumns {
  explicit PatternColumns(const Problem& problem);
  /// Ranges of columns that an observation in this image touches on the camera side.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> of_image(std::uint32_t image) const;

  const Problem* problem;
  bool own_lenses = false;
  std::uint64_t camera_side = 0, points = 0;  ///< numbers of columns
};

/// Rows are the observations sorted by point, two for each.
PatternGrid jacobian_pattern(const Problem& problem, const Tracks& tracks, int height, int width,
                             int camera_width);
/// J^T J.
PatternGrid hessian_pattern(const Problem& problem, const Tracks& tracks, int size,
                            int camera_size);

/// Images against images: the reduced camera matrix by blocks. A pixel holds the largest number of
/// common points of the pairs in it (on the diagonal: of observations).
struct ReducedPattern {
  int size = 0;                             ///< pixels a side
  std::vector<std::uint32_t> largest;       ///< size x size
  std::uint64_t links = 0;                  ///< pairs of images with common points
  std::uint32_t strongest = 0;              ///< of any pair
  std::vector<std::uint32_t> observations;  ///< in each image
};
struct Link {
  std::uint32_t a = 0, b = 0, points = 0;
};
/// And the `most_links` strongest links, weakest first.
ReducedPattern reduced_pattern(const Problem& problem, const Tracks& tracks, int most_pixels,
                               std::size_t most_links, std::vector<Link>& strongest);

}  // namespace sheaf
