// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/camera_solver.h"

namespace sheaf {

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
      rhs[c] -= block[diagonal_layout::right_side(k)];
      squares[c] += diagonal_entry(block, k, k) + block[diagonal_layout::squares(k)];
    }
  }
}

}  // namespace sheaf
