// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lists/chunks.h"
#include "lists/lens_tracks.h"

namespace sheaf {

/// Points: 24 doubles per group: X of the eight lanes, then Y, then Z.
constexpr std::size_t kPointGroup = 24;
/// What elimination leaves per group, 8 lanes each: the factor L^-1 with V + D = L L^T stored as
/// i00, l10, l20, i11, l21, i22 (diagonal inverted), w = L^-1 g (3), D (3). V, L, g and w are by X,
/// Y and Z, whatever the chart; D is by the chart's coordinates.
constexpr std::size_t kFactorGroup = 96;

/// Column order of a camera block: rho (3), phi (3), f, k1, k2.
constexpr int kCameraColumns = 9;

/// Sums of one slice. A tile holds T_a T_b^T of the pair (row, column): rows 0..7 x columns 0..7
/// row-major (64), row 8 x columns 0..7 (8), rows 0..7 x column 8 (8), (8, 8), 7 unused.
constexpr std::size_t kTileDoubles = 88;
/// Per image: sum C^T C rows 0..7 x columns 0..7 (64), row 8 x columns 0..7 (8), sum C^T h columns
/// 0..7 (8), sum of squares of T columns 0..7 (8), then (8, 8), h of column 8, squares of T column
/// 8, 5 unused.
constexpr std::size_t kDiagonalDoubles = 96;

/// Records of one chunk's elimination, in one thread's scratch. T: 32 doubles per record (three
/// columns of W L^-T, rows 0..7 each; then row 8 of the three, 0, C row 8 (2), h (2)).
/// C: 16 doubles per record. Jacobians: of one group at a time.
struct Records {
  double *T, *C, *jacobians;
};
constexpr std::size_t kTRecord = 32, kCRecord = 16;

constexpr std::size_t kLensRecord = 40, kBlockSums = 504;

/// Modes of a cluster of the coarse space (reduced/coarse_space.h).
constexpr int kCoarseModes = 8;
/// Z of an image: rows 0..6 of its nine (rho, phi, f) x modes, row-major.
constexpr std::size_t kCoarseBasis = 56;
/// A pair of clusters' sum: modes of the row's x modes of the column's, row-major.
constexpr std::size_t kCoarseTile = 64;
/// Where the sums of products of lenses' blocks go: the numbers of their tiles. Empty where nothing
/// but diagonal blocks is wanted.
struct LensTiles {
  std::vector<std::uint32_t> of_image;  ///< two per image: lens's block 0 or 1, and the image
  std::vector<std::uint32_t> of_lens;   ///< one per lens: its blocks 1 and 0
};

/// Rows of slots of a chunk before the group's.
inline std::uint64_t slots_before(const LensTracks& tracks, const Chunk& chunk, std::size_t group) {
  return tracks.first_slot[group] - tracks.first_slot[chunk.first_group];
}

}  // namespace sheaf
