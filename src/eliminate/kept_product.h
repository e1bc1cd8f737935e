// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "lists/batches.h"
#include "lists/block_layout.h"
#include "lists/chunks.h"
#include "lists/lens_tracks.h"

namespace sheaf {

/// Rows of observations through lenses, kept in single precision: products with them read what
/// would take several times as long to compute again. With so many blocks of a lens, a batch has
/// this many fields of eight floats: the point's two rows of three, the image's two of nine, then
/// two of nine for each block; all multiplied by the root of the loss's weight, 0 in masked lanes.
namespace kept_row {
constexpr int point(int row, int column) { return 3 * row + column; }
constexpr int camera(int row, int column) { return 6 + 9 * row + column; }
constexpr int lens(int block, int row, int column) { return 24 + 18 * block + 9 * row + column; }
constexpr std::size_t fields(int lens_blocks) {
  return 24 + 18 * static_cast<std::size_t>(lens_blocks);
}
}  // namespace kept_row

/// Doubles that go into floats are brought next to 1 by a power of two: `unit` is about 1 / the
/// length of the scene. Rows hold Jp / unit, and L^-1 becomes unit L^-1.
struct KeptProductInput {
  const Batches* batches;
  const LensTracks* tracks;
  const float* rows;      ///< 8 x kept_row::fields for each batch
  const double* factors;  ///< kFactorGroup per group
  double unit;
  const float* x;  ///< kBlockVector per block of an image or a lens
};

/// One instruction set's product over one chunk: y += (U - W (V + D)^-1 W^T) x, sums over blocks in
/// double.
struct KeptProduct {
  const char* name;
  void (*product)(const KeptProductInput&, const Chunk&, double* y);
};
/// simd_name: as of Kernels; "scalar" gives plain code, one observation at a time, in double.
const KeptProduct& kept_product(const char* simd_name);
const KeptProduct& reference_kept_product();

}  // namespace sheaf
