// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "reduced/camera_solver.h"

namespace sheaf {

/// The diagonal blocks of the damped reduced camera matrix, factored: exact where images do not
/// couple, the Schur-Jacobi preconditioner elsewhere. An image with a lens of its own is one block
/// of up to nine columns; poses of images that share a lens, and that lens, are blocks apart.
class BlockDiagonal {
 public:
  BlockDiagonal(const Columns& columns, Threads& threads);

  bool factor(const double* diagonal, const double* damping);
  /// z <- M^-1 r.
  void solve(const double* r, double* z) const;
  std::uint64_t bytes() const;

 private:
  struct Block {
    std::array<std::int32_t, 9> column;
    std::array<std::int8_t, 9> local;  ///< position within the image's nine
    int size = 0;
    std::size_t first_image = 0, num_images = 0;  ///< in images_
  };
  template <class Task>
  void for_each_block(const Task& task) const;

  std::vector<Block> blocks_;
  std::vector<std::uint32_t> images_;  ///< whose diagonal blocks add up to each block
  Buffer<double> factors_;             ///< 81 per block: L, row-major, diagonal inverted
  Threads& threads_;
};

}  // namespace sheaf
