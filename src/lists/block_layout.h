// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Where numbers stand in all that kernels, sums and camera solvers hand to each other. Offsets
// count doubles (or floats) from the start of a record, a block or a group.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lists/chunks.h"
#include "lists/lens_tracks.h"

namespace sheaf {

// Groups of eight points.

/// Points: 24 doubles per group: X of the eight lanes, then Y, then Z.
constexpr std::size_t kPointGroup = 24;

/// What elimination leaves per group, 8 lanes each: the factor L^-1 with V + D = L L^T stored as
/// i00, l10, l20, i11, l21, i22 (diagonal inverted), w = L^-1 g (3), D (3). V, L, g and w are by X,
/// Y and Z, whatever the chart; D is by the chart's coordinates.
constexpr std::size_t kFactorGroup = 96;
namespace factor_group {
constexpr int kFields = 12;
constexpr int kFactorFields = 6;  ///< the first ones
constexpr int factor(int field) { return 8 * field; }
constexpr int w(int i) { return 8 * (6 + i); }
constexpr int damping(int i) { return 8 * (9 + i); }
}  // namespace factor_group

/// What a loss makes of the rows of a batch, M = w I - u u^T of eight lanes
/// (geometry/row_metric.h): w, then the two components of u.
constexpr std::size_t kMetricBatch = 24;
namespace metric_batch {
constexpr int kWeight = 0, kAlong = 8;
}

// The state of images and lenses as kernels read it.

/// What the records of images of every kind begin with: R (9, row-major), t (3).
namespace pose_record {
constexpr int kRotation = 0, kTranslation = 9, kCount = 12;
}

/// Of a BAL camera: the pose, f, k1, k2, then the step to back-substitute: rho (3), phi (3) and
/// what it does to f d: df, k1 df + f dk1, k2 df + f dk2 by 1, n and n^2.
constexpr std::size_t kCameraRecord = 24;
namespace camera_record {
constexpr int kRotation = pose_record::kRotation, kTranslation = pose_record::kTranslation;
constexpr int kFocal = 12, kK1 = 13, kK2 = 14;
constexpr int kStep = 15, kRho = 15, kPhi = 18, kRadial = 21;
constexpr std::size_t kStateOctets = 2, kOctets = 3;  ///< eights to read: without the step, with it

/// The step's nine fields from a camera's columns x; lens: f, k1, k2.
inline void write_step(const double* lens, const double* x, double* step) {
  for (int k = 0; k < 3; ++k) {
    step[kRho - kStep + k] = x[k];
    step[kPhi - kStep + k] = x[3 + k];
  }
  double* radial = step + kRadial - kStep;
  radial[0] = x[6];
  radial[1] = lens[1] * x[6] + lens[0] * x[7];
  radial[2] = lens[2] * x[6] + lens[0] * x[8];
}
}  // namespace camera_record

/// The 24 fields of a camera record in floats, and 8 unused.
constexpr std::size_t kFloatCameraRecord = 32;

/// Of an image that looks through a lens of any model: the pose, the step to back-substitute (rho,
/// phi), 6 unused.
constexpr std::size_t kImageRecord = 24;
namespace image_record {
constexpr int kStep = pose_record::kCount;
}
/// Of a lens: its parameters, then their step.
constexpr std::size_t kLensRecord = 2 * kMaxCameraParameters;
namespace lens_record {
constexpr int kStep = static_cast<int>(kMaxCameraParameters);
}

// Blocks of the camera side. Each has nine columns: eight in a vector, the ninth beside it.

/// Column order of a camera block: rho (3), phi (3), f, k1, k2.
constexpr int kCameraColumns = 9;
/// One number for each of a block's columns, 7 unused: a step, or a vector to multiply.
constexpr std::size_t kBlockVector = 16;

/// Sums of one slice. A tile holds T_a T_b^T of the pair (row, column): rows 0..7 x columns 0..7
/// row-major (64), row 8 x columns 0..7 (8), rows 0..7 x column 8 (8), (8, 8), 7 unused.
constexpr std::size_t kTileDoubles = 88;
namespace tile_layout {
constexpr int kRow8 = 64, kColumn8 = 72, kCorner = 80;
constexpr int at(int row, int column) {
  return column < 8 ? 8 * row + column : row < 8 ? kColumn8 + row : kCorner;
}
}  // namespace tile_layout

/// Per block: sum C^T C rows 0..7 x columns 0..7 (64), row 8 x columns 0..7 (8), sum C^T h columns
/// 0..7 (8), sum of squares of T columns 0..7 (8), then (8, 8), h of column 8, squares of T column
/// 8, 5 unused.
constexpr std::size_t kDiagonalDoubles = 96;
namespace diagonal_layout {
constexpr int kRow8 = 64, kRightSide = 72, kSquares = 80;
constexpr int kCorner = 88, kRightSide8 = 89, kSquares8 = 90;
/// The block is symmetric: what stands at (8, k) stands at (k, 8) too.
constexpr int at(int row, int column) {
  if (row < 8 && column < 8) return 8 * row + column;
  return row == column ? kCorner : kRow8 + (row < column ? row : column);
}
/// Which of the two is summed.
constexpr bool is_stored(int row, int column) { return column < 8 || row == 8; }
constexpr int right_side(int column) { return column < 8 ? kRightSide + column : kRightSide8; }
constexpr int squares(int column) { return column < 8 ? kSquares + column : kSquares8; }
}  // namespace diagonal_layout

/// Entry (r, k) of an image's symmetric diagonal block.
inline double diagonal_entry(const double* block, int r, int k) {
  return block[diagonal_layout::at(r, k)];
}
/// Entry (r, k) of a tile: row image's r, column image's k.
inline double tile_entry(const double* tile, int r, int k) { return tile[tile_layout::at(r, k)]; }

/// A 9x9 block of numbers, float or double, that is multiplied with vectors: nine columns of rows
/// 0..7, then row 8, 7 unused.
constexpr std::size_t kBlockEntry = 88;
namespace block_entry {
constexpr int kRow8 = 72, kCorner = 80;
constexpr int at(int row, int column) { return row < 8 ? 8 * column + row : kRow8 + column; }
}  // namespace block_entry

// Records of one chunk's elimination, in one thread's scratch.

/// T: three columns of W L^-T, rows 0..7 each; then row 8 of the three, 0, C row 8 (2), h (2).
/// C: two rows of columns 0..7.
constexpr std::size_t kTRecord = 32, kCRecord = 16;
namespace t_record {
constexpr int kRow8 = 24, kC8 = 28, kH = 30;
constexpr int column(int q) { return 8 * q; }
constexpr int at(int q, int row) { return row < 8 ? column(q) + row : kRow8 + q; }
}  // namespace t_record
namespace c_record {
constexpr int row(int r) { return 8 * r; }
}  // namespace c_record
/// Jacobians: of one group at a time.
struct Records {
  double *T, *C, *jacobians;
};

/// Of an observation and a block of its lens (eliminate/lens_kernels.h): C's two rows (8 each),
/// G's two rows, then, where a lens has nine columns in the block, their ninths: C (2), G (2), 4
/// unused.
constexpr std::size_t kLensPairRecord = 40;
namespace lens_pair_record {
constexpr int kC = 0, kG = 16, kC8 = 32, kG8 = 34;
}
/// Sums T_l of a slot: 9 x 3 numbers, eight lanes each; columns of the block first.
constexpr std::size_t kSlotSums = 8 * 27;
/// Numbers of a lens's block that is summed lane by lane, eight lanes each: the lower triangle, row
/// by row; the right-hand side; the squares that T took from the columns.
namespace block_sums {
constexpr int kRightSide = 45, kSquares = 54, kFields = 63;
constexpr int at(int row, int column) { return row * (row + 1) / 2 + column; }
}  // namespace block_sums
constexpr std::size_t kBlockSums = 8 * block_sums::kFields;

// Products with the reduced matrix.

/// Of an image: rho (3), phi (3), then sums of s, s n and s n^2 (s = p . e), 7 unused:
///   y_f = s0 + k1 s1 + k2 s2, y_k1 = f s1, y_k2 = f s2.
/// Of blocks of other kinds: nine columns.
constexpr std::size_t kProductRecord = kBlockVector;
inline void read_product(const double* lens, const double* sums, double* y) {
  for (int k = 0; k < 6; ++k) y[k] = sums[k];
  y[6] = sums[6] + lens[1] * sums[7] + lens[2] * sums[8];
  y[7] = lens[0] * sums[7];
  y[8] = lens[0] * sums[8];
}

/// Fields that the second sweep of a BAL product over a point's track needs from the first (iz, p,
/// f d, dd, e), beside the camera's; and doubles of a batch's, of which the widest are two groups'
/// in floats.
constexpr int kSweepFields = 7;
constexpr std::size_t kProductScratch = 8 * (kCameraRecord + kSweepFields);

/// Modes of a cluster of the coarse space (reduced/coarse_space.h).
constexpr int kCoarseModes = 8;
/// Z of an image: rows 0..6 of its nine (rho, phi, f) x modes, row-major.
constexpr std::size_t kCoarseBasis = 56;
/// A pair of clusters' sum: modes of the row's x modes of the column's, row-major.
constexpr std::size_t kCoarseTile = 64;
/// Of each cluster that a point touches while it is summed: three rows of modes, and two numbers.
constexpr std::size_t kCoarseScratch = 3 * kCoarseModes + 1;

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

/// Work, counted roughly: flops to linearise an observation, eliminate its point and sum its
/// diagonal block; and to multiply a pair of records.
namespace flops {
constexpr double kObservation = 700, kPair = 490;
}
/// Flops to linearise so many batches and to multiply so many pairs.
constexpr double linearize_flops(std::uint64_t batches, std::uint64_t pairs) {
  return 8.0 * flops::kObservation * static_cast<double>(batches) +
         flops::kPair * static_cast<double>(pairs);
}

}  // namespace sheaf
