// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/camera_solver.h"

#include <algorithm>

namespace sheaf {

double diagonal_entry(const double* block, int r, int k) {
  if (r < 8 && k < 8) return block[8 * r + k];
  return r == 8 && k == 8 ? block[88] : block[64 + std::min(r, k)];
}

double tile_entry(const double* tile, int r, int k) {
  return k < 8 ? tile[8 * r + k] : tile[r < 8 ? 72 + r : 80];
}

void CameraVectors::gather(const ReducedSums& sums, const Columns& columns) {
  const std::size_t padded = (static_cast<std::size_t>(columns.count) + 7) / 8 * 8;
  if (rhs.size() != padded) {
    rhs.allocate(padded);
    squares.allocate(padded);
  }
  rhs.fill(0);
  squares.fill(0);
  for (std::size_t i = 0; i < columns.num_images(); ++i) {
    const double* block = sums.diagonal + kDiagonalDoubles * i;
    for (int k = 0; k < 9; ++k) {
      const std::int32_t c = columns.image(i)[k];
      if (c == Columns::kFixed) continue;
      rhs[c] -= k < 8 ? block[72 + k] : block[89];
      squares[c] += diagonal_entry(block, k, k) + (k < 8 ? block[80 + k] : block[90]);
    }
  }
}

}  // namespace sheaf
