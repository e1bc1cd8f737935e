// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Patches whose pixels move with their middle: kLanes patches at a time, each in a lane. All pixels
// of a patch then have the same fraction of a pixel, and interpolation separates into rows and
// columns; nothing needs to be added across lanes.
#if defined(SHEAF_RESIDUAL_TRANSLATED_PATCHES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_RESIDUAL_TRANSLATED_PATCHES_INL_H_
#undef SHEAF_RESIDUAL_TRANSLATED_PATCHES_INL_H_
#else
#define SHEAF_RESIDUAL_TRANSLATED_PATCHES_INL_H_
#endif

#include <algorithm>
#include <limits>

#include "residual/patch_sums-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// kLanes x kLanes transpose.
template <class W>
HWY_INLINE void transpose_greys(const W* in, W* out) {
#if HWY_TARGET == HWY_SCALAR
  out[0] = in[0];
#else
  [[maybe_unused]] const GreyTag d;
  if constexpr (kLanes == 2) {
    out[0] = hn::InterleaveLower(d, in[0], in[1]), out[1] = hn::InterleaveUpper(d, in[0], in[1]);
  } else {
    // Pairs of greys, then pairs of pairs, then halves.
    const hn::Repartition<double, GreyTag> wide;
    W low[kLanes / 2], high[kLanes / 2];
    for (int i = 0; i < kLanes / 2; ++i) {
      low[i] = hn::InterleaveLower(d, in[2 * i], in[2 * i + 1]);
      high[i] = hn::InterleaveUpper(d, in[2 * i], in[2 * i + 1]);
    }
    W quarter[kLanes / 4][4];
    for (int i = 0; i < kLanes / 4; ++i) {
      const auto a = hn::BitCast(wide, low[2 * i]), b = hn::BitCast(wide, low[2 * i + 1]);
      const auto e = hn::BitCast(wide, high[2 * i]), f = hn::BitCast(wide, high[2 * i + 1]);
      quarter[i][0] = hn::BitCast(d, hn::InterleaveLower(wide, a, b));
      quarter[i][1] = hn::BitCast(d, hn::InterleaveUpper(wide, a, b));
      quarter[i][2] = hn::BitCast(d, hn::InterleaveLower(wide, e, f));
      quarter[i][3] = hn::BitCast(d, hn::InterleaveUpper(wide, e, f));
    }
    for (int k = 0; k < 4; ++k) {
      if constexpr (kLanes == 8) {
        out[k] = hn::ConcatLowerLower(d, quarter[1][k], quarter[0][k]);
        out[4 + k] = hn::ConcatUpperUpper(d, quarter[1][k], quarter[0][k]);
      } else {
        out[k] = quarter[0][k];
      }
    }
  }
#endif
}

/// kLanes greys from each lane's place on: one vector for each.
HWY_INLINE void load_columns(const float* const* from, std::ptrdiff_t offset, V* columns) {
  Greys in[kLanes], out[kLanes];
  for (int l = 0; l < kLanes; ++l) in[l] = hn::LoadU(GreyTag(), from[l] + offset);
  transpose_greys(in, out);
  for (int l = 0; l < kLanes; ++l) columns[l] = hn::PromoteTo(D(), out[l]);
}

/// Columns and rows that are interpolated at once.
constexpr int kMostColumns = 5, kMostRows = 9;

/// Where each lane's patch reads its image: one pixel left of and above the grid's corner.
struct Corners {
  const float* at[kLanes];
  std::ptrdiff_t stride[kLanes];
};

template <bool kCubic>
HWY_INLINE V value_across(const V* weights, V a, V b, V c, V d) {
  if constexpr (kCubic) return across(weights, a, b, c, d);
  return fma(weights[1], b, hn::Mul(weights[2], c));
}

/// Some columns of some rows of the grid; `references` has kLanes doubles for each of its cells.
template <bool kBrightness, bool kCubic, int kColumns>
HWY_INLINE void sum_tile(const PatchGrid& grid, const Corners& corners, int column, int row,
                         const SpreadTaps& x, const SpreadTaps& y, const double* references,
                         const Look& look, V* sums) {
  const int rows = std::min(kMostRows, grid.rows - row);
  V value[kMostRows + 3][kColumns], slope[kMostRows + 3][kColumns];
  const float* at[kLanes];
  for (int l = 0; l < kLanes; ++l) at[l] = corners.at[l] + row * corners.stride[l] + column;
  for (int r = 0; r < rows + 3; ++r) {
    V p[kMostColumns + 3];
    for (int c = 0; c < kColumns + 3; c += kLanes) load_columns(at, c, p + c);
    for (int c = 0; c < kColumns; ++c) {
      value[r][c] = value_across<kCubic>(x.value, p[c], p[c + 1], p[c + 2], p[c + 3]);
      slope[r][c] = across(x.slope, p[c], p[c + 1], p[c + 2], p[c + 3]);
    }
    for (int l = 0; l < kLanes; ++l) at[l] += corners.stride[l];
  }
  for (int c = 0; c < kColumns; ++c) {
    if (column + c >= grid.width) break;
    V v0 = value[0][c], v1 = value[1][c], v2 = value[2][c];
    V s0 = slope[0][c], s1 = slope[1][c], s2 = slope[2][c];
    for (int r = 0; r < rows; ++r) {
      const V v3 = value[r + 3][c], s3 = slope[r + 3][c];
      const int cell = grid.cell_at[grid.width * (row + r) + column + c];
      if (cell >= 0)
        add_pixels<kBrightness, false>(
            {load(references + kLanes * cell), value_across<kCubic>(y.value, v0, v1, v2, v3),
             value_across<kCubic>(y.value, s0, s1, s2, s3), across(y.slope, v0, v1, v2, v3)},
            look, zero(), sums);
      v0 = v1, v1 = v2, v2 = v3, s0 = s1, s1 = s2, s2 = s3;
    }
  }
}

/// The whole grid, in columns of much the same number.
template <bool kBrightness, bool kCubic>
HWY_NOINLINE void sum_translated(const PatchGrid& grid, const Corners& corners, const SpreadTaps& x,
                                 const SpreadTaps& y, const double* references, const Look& look,
                                 V* to) {
  V sums[kPatchSums<kBrightness>];
  for (V& s : sums) s = zero();
  for (int row = 0; row < grid.rows; row += kMostRows) {
    int tiles = (grid.width + kMostColumns - 1) / kMostColumns;
    for (int column = 0; column < grid.width; --tiles) {
      const int columns = (grid.width - column + tiles - 1) / tiles;
      const auto sum = columns > 4   ? sum_tile<kBrightness, kCubic, 5>
                       : columns > 3 ? sum_tile<kBrightness, kCubic, 4>
                                     : sum_tile<kBrightness, kCubic, 3>;
      sum(grid, corners, column, row, x, y, references, look, sums);
      column += columns;
    }
  }
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) to[k] = sums[k];
}

/// The references of a part's points: kLanes doubles for each cell of the grid.
HWY_INLINE void spread_references(const PhotometricInput& in, const Batches::Group& group,
                                  std::size_t g, int part, double* to) {
  const std::size_t cells = in.grid->cells();
  const float* from[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    const std::size_t lane = part * kLanes + l;
    from[l] =
        in.references + cells * in.batches->lane_point[8 * g + (lane < group.lanes ? lane : 0)];
  }
  for (std::size_t cell = 0; cell < cells; cell += kLanes) {
    V greys[kLanes];
    load_columns(from, static_cast<std::ptrdiff_t>(cell), greys);
    for (int k = 0; k < kLanes; ++k) store(greys[k], to + kLanes * (cell + k));
  }
}

/// The sums of a part's patches; 1 in `inside` for those that fit, and no place in `seen` for the
/// others. Returns how many of these there are.
template <bool kBrightness>
HWY_INLINE std::uint64_t sum_translated_lanes(const PhotometricInput& in, const PatchLanes& lanes,
                                              const Place& at, const double* references,
                                              double* seen, double* inside, V* sums) {
  const PatchGrid& grid = *in.grid;
  std::uint64_t left = 0;
  alignas(64) double z[8];
  store(at.P[2], z);
  Corners corners;
  int one = -1;
  for (int l = 0; l < kLanes; ++l) {
    const GreyPlane& plane = in.planes[in.block_image[lanes.block[l]]];
    const bool used = l < lanes.used;
    const bool fits = used && z[l] > 0 && patch_fits(grid, plane, seen[l], seen[8 + l]);
    inside[l] = fits ? 1 : 0;
    if (fits) {
      corners.at[l] = plane.at(static_cast<int>(seen[l]) + grid.left - 1,
                               static_cast<int>(seen[8 + l]) + grid.top - 1);
      corners.stride[l] = plane.stride();
      one = l;
    } else {
      seen[l] = seen[8 + l] = std::numeric_limits<double>::quiet_NaN();
      left += used;
    }
  }
  if (one < 0) {
    for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = zero();
    return left;
  }
  for (int l = 0; l < kLanes; ++l)  // the others read what one that fits does, in vain
    if (inside[l] == 0) corners.at[l] = corners.at[one], corners.stride[l] = corners.stride[one];
  const auto fits = hn::Gt(load(inside), zero());
  const V x = hn::IfThenElseZero(fits, at.x), y = hn::IfThenElseZero(fits, at.y);
  const SpreadTaps across_x(in.taps, hn::Sub(x, hn::Floor(x)));
  const SpreadTaps across_y(in.taps, hn::Sub(y, hn::Floor(y)));
  const Look look(in, lanes.alpha, lanes.beta);
  (in.taps == Taps::catmull_rom ? sum_translated<kBrightness, true>
                                : sum_translated<kBrightness, false>)(grid, corners, across_x,
                                                                      across_y, references, look,
                                                                      sums);
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = hn::IfThenElseZero(fits, sums[k]);
  return left;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
