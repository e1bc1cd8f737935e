// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace sheaf {

/// The fields of an observation's two rows in the order in which they are stored: residual (2), by
/// the camera block (2 x 9), by the point (2 x 3); then, where lenses have blocks of their own, by
/// each of these (2 x 9).
namespace row_field {
constexpr int residual(int row) { return row; }
constexpr int camera(int row, int column) { return 2 + 9 * row + column; }
constexpr int point(int row, int column) { return 20 + 3 * row + column; }
constexpr int kCount = 26;
/// Counted from the lenses' first field.
constexpr int lens(int block, int row, int column) { return 18 * block + 9 * row + column; }
/// With the fields of so many blocks of a lens.
constexpr std::size_t count(int lens_blocks) {
  return kCount + 18 * static_cast<std::size_t>(lens_blocks);
}
}  // namespace row_field

/// Doubles of the stored rows of one batch: the fields of eight lanes, part by part of the
/// instruction set that wrote them.
constexpr std::size_t kRowBatch = 8 * row_field::kCount;

/// Where plain code finds them in the stored rows of a batch: field f of a lane is at
///   rows[kRowBatch * batch + first_row_field(lanes, lane) + lanes * f]
/// with so many lanes in a part of the instruction set (RowKernels::lanes).
constexpr std::size_t first_row_field(int lanes, int lane) {
  return static_cast<std::size_t>(lane / lanes * row_field::kCount * lanes + lane % lanes);
}

/// The reference kernels keep the rows of each lane together.
constexpr int kReferenceLanes = 1;

}  // namespace sheaf
