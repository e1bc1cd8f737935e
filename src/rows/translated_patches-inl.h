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

#include <hwy/cache_control.h>

#include <algorithm>
#include <limits>

#include "rows/patch_sums-inl.h"

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
  std::ptrdiff_t stride;  ///< of all
};

template <bool kCubic>
HWY_INLINE V value_across(const V* weights, V a, V b, V c, V d) {
  if constexpr (kCubic) return across(weights, a, b, c, d);
  return fma(weights[1], b, hn::Mul(weights[2], c));
}

/// Zeros that no compiler knows to be: of constants it makes an array to be cleared byte by byte,
/// which takes as long as three pixels.
template <bool kBrightness>
HWY_INLINE void begin_sums(const Look& look, V* sums) {
  const V none = hn::Sub(look.beta, look.beta);
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = none;
}

/// The sums over some columns of some rows of the grid; `references` has kLanes doubles for each
/// pixel of its rectangle.
template <bool kBrightness, bool kCubic, int kColumns>
HWY_INLINE void sum_tile(const PatchGrid& grid, const Corners& corners, int column, int row,
                         const SpreadTaps& x, const SpreadTaps& y, const double* references,
                         const Look& look, V* to) {
  const int rows = std::min(kMostRows, grid.rows - row);
  V value[kMostRows + 3][kColumns], slope[kMostRows + 3][kColumns];
  std::ptrdiff_t from = row * corners.stride + column;
  for (int r = 0; r < rows + 3; ++r, from += corners.stride) {
    V p[kMostColumns + 3];
    for (int c = 0; c < kColumns + 3; c += kLanes) load_columns(corners.at, from + c, p + c);
    for (int c = 0; c < kColumns; ++c) {
      value[r][c] = value_across<kCubic>(x.value, p[c], p[c + 1], p[c + 2], p[c + 3]);
      slope[r][c] = across(x.slope, p[c], p[c + 1], p[c + 2], p[c + 3]);
    }
  }
  V sums[kPatchSums<kBrightness>];
  begin_sums<kBrightness>(look, sums);
  for (int c = 0; c < kColumns; ++c) {
    if (column + c >= grid.width) break;
    V v0 = value[0][c], v1 = value[1][c], v2 = value[2][c];
    V s0 = slope[0][c], s1 = slope[1][c], s2 = slope[2][c];
    for (int r = 0; r < rows; ++r) {
      const V v3 = value[r + 3][c], s3 = slope[r + 3][c];
      const int spot = grid.width * (row + r) + column + c;
      if (grid.cell_at[spot] >= 0)
        add_pixels<kBrightness, false>(
            {load(references + kLanes * spot), value_across<kCubic>(y.value, v0, v1, v2, v3),
             value_across<kCubic>(y.value, s0, s1, s2, s3), across(y.slope, v0, v1, v2, v3)},
            look, zero(), sums);
      v0 = v1, v1 = v2, v2 = v3, s0 = s1, s1 = s2, s2 = s3;
    }
  }
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) to[k] = sums[k];
}

/// As sum_tile, where slopes are central differences: those of values one pixel apart that are read
/// anyway, so nothing but values is interpolated. Slopes are twice what they are. kPlain: the grid
/// is whole, pixels are not weighed and the tile has kColumns columns.
template <bool kBrightness, bool kPlain, int kColumns>
HWY_INLINE void sum_central_tile(const PatchGrid& grid, const Corners& corners, int column, int row,
                                 V fx, V fy, const double* references, const Look& look, V* to) {
  const int rows = std::min(kMostRows, grid.rows - row);
  V value[kMostRows + 2][kColumns + 2], above[kColumns + 2];
  std::ptrdiff_t from = row * corners.stride + column;
  const auto read_row = [&](V* values) {
    V p[kMostColumns + 3];
    for (int c = 0; c < kColumns + 3; c += kLanes) load_columns(corners.at, from + c, p + c);
    for (int c = 0; c < kColumns + 2; ++c) values[c] = fma(fx, hn::Sub(p[c + 1], p[c]), p[c]);
    from += corners.stride;
  };
  read_row(above);
  for (int r = 0; r < rows + 2; ++r) {
    V below[kColumns + 2];
    read_row(below);
    for (int c = 0; c < kColumns + 2; ++c) {
      value[r][c] = fma(fy, hn::Sub(below[c], above[c]), above[c]);
      above[c] = below[c];
    }
  }
  V sums[kPatchSums<kBrightness>];
  begin_sums<kBrightness>(look, sums);
  for (int r = 0; r < rows; ++r) {
    const V *before = value[r], *middle = value[r + 1], *after = value[r + 2];
    const int spot = grid.width * (row + r) + column;
    for (int c = 0; c < kColumns; ++c) {
      if (!kPlain && column + c >= grid.width) break;
      if (!kPlain && grid.cell_at[spot + c] < 0) continue;
      add_pixels<kBrightness, false, !kPlain>(
          {load(references + kLanes * (spot + c)), middle[c + 1], hn::Sub(middle[c + 2], middle[c]),
           hn::Sub(after[c + 1], before[c + 1])},
          look, zero(), sums);
    }
  }
  if (kPlain) sums[kCost] = sums[kSquare];
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) to[k] = sums[k];
}

/// Slopes that were twice what they are.
template <bool kBrightness>
HWY_INLINE void halve_slopes(V* sums) {
  for (int k : {kGxx, kGxy, kGyy}) sums[k] = hn::Mul(set(0.25), sums[k]);
  for (int k : {kGxr, kGyr}) sums[k] = hn::Mul(set(0.5), sums[k]);
  if constexpr (kBrightness)
    for (int k : {kGxg, kGyg, kGx1, kGy1}) sums[k] = hn::Mul(set(0.5), sums[k]);
}

/// The sums over the whole grid, in columns of much the same number: sum(column, row, columns, to).
template <bool kBrightness, class Sum>
HWY_INLINE void sum_tiles(const PatchGrid& grid, const Sum& sum, V* to) {
  for (int row = 0; row < grid.rows; row += kMostRows) {
    int tiles = (grid.width + kMostColumns - 1) / kMostColumns;
    for (int column = 0; column < grid.width; --tiles) {
      const int columns = (grid.width - column + tiles - 1) / tiles;
      if (row == 0 && column == 0) {
        sum(column, row, columns, to);
      } else {
        V more[kPatchSums<kBrightness>];
        sum(column, row, columns, more);
        for (int k = 0; k < kPatchSums<kBrightness>; ++k) to[k] = hn::Add(to[k], more[k]);
      }
      column += columns;
    }
  }
}

template <bool kBrightness, bool kPlain>
HWY_NOINLINE void sum_central(const PatchGrid& grid, const Corners& corners, V fx, V fy,
                              const double* references, const Look& look, V* to) {
  const auto tile = [&](int column, int row, int columns, V* sums) {
    const auto sum = columns > 4   ? sum_central_tile<kBrightness, kPlain, 5>
                     : columns > 3 ? sum_central_tile<kBrightness, kPlain, 4>
                                   : sum_central_tile<kBrightness, kPlain, 3>;
    sum(grid, corners, column, row, fx, fy, references, look, sums);
  };
  sum_tiles<kBrightness>(grid, tile, to);
  halve_slopes<kBrightness>(to);
}

template <bool kBrightness, bool kCubic>
HWY_NOINLINE void sum_translated(const PatchGrid& grid, const Corners& corners, const SpreadTaps& x,
                                 const SpreadTaps& y, const double* references, const Look& look,
                                 V* to) {
  const auto tile = [&](int column, int row, int columns, V* sums) {
    const auto sum = columns > 4   ? sum_tile<kBrightness, kCubic, 5>
                     : columns > 3 ? sum_tile<kBrightness, kCubic, 4>
                                   : sum_tile<kBrightness, kCubic, 3>;
    sum(grid, corners, column, row, x, y, references, look, sums);
  };
  sum_tiles<kBrightness>(grid, tile, to);
}

/// The references of a part's points: kLanes doubles for each pixel of the grid's rectangle, and as
/// many for what is in no pixel.
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
    for (int k = 0; k < kLanes; ++k) store(greys[k], to + kLanes * in.grid->spot[cell + k]);
  }
}

/// The planes that a part's patches are in.
struct LanePlanes {
  V width, height, stride;
  const float* origin[kLanes];
  std::ptrdiff_t strides[kLanes];
  bool one_stride = true;

  HWY_INLINE LanePlanes(const PhotometricInput& in, const std::uint32_t* block, bool uniform) {
    const GreyPlane& first = in.planes[in.block_image[block[0]]];
    width = set(first.width()), height = set(first.height());
    stride = set(static_cast<double>(first.stride()));
    for (int l = 0; l < kLanes; ++l) origin[l] = first.at(0, 0), strides[l] = first.stride();
    if (uniform) return;
    alignas(64) double of[3][8];
    for (int l = 0; l < kLanes; ++l) {
      const GreyPlane& plane = in.planes[in.block_image[block[l]]];
      origin[l] = plane.at(0, 0), strides[l] = plane.stride();
      one_stride &= strides[l] == strides[0];
      of[0][l] = plane.width(), of[1][l] = plane.height();
      of[2][l] = static_cast<double>(plane.stride());
    }
    width = load(of[0]), height = load(of[1]), stride = load(of[2]);
  }

  /// patch_fits.
  HWY_INLINE hn::Mask<D> fit(const PatchGrid& grid, V x, V y) const {
    const auto inside = [](V at, int first, int last, V size) {
      return hn::And(hn::Ge(hn::Add(at, set(first)), set(1.0)),
                     hn::Le(hn::Add(at, set(last)), hn::Sub(size, set(2.0))));
    };
    return hn::And(inside(x, grid.left, grid.right(), width),
                   inside(y, grid.top, grid.bottom(), height));
  }
};

/// Where the pixels of a part's patches are: all lanes read something, those that do not fit in
/// vain. 1 in `inside` for those that fit, and no place in `seen` for the others, which `left`
/// counts.
struct TranslatedLanes {
  Corners corners;
  bool any = false;  ///< fits
  std::uint64_t left = 0;
  float* windows = nullptr;  ///< room for all that the lanes read
  alignas(64) double inside[8];

  static std::ptrdiff_t window_stride(const PatchGrid& grid) { return grid.width + 16; }
  static std::size_t window_floats(const PatchGrid& grid) {
    return static_cast<std::size_t>(kLanes * (grid.rows + 3) * window_stride(grid));
  }

  HWY_INLINE void find(const PhotometricInput& in, const PatchLanes& lanes, const Place& at,
                       double* seen) {
    const PatchGrid& grid = *in.grid;
    const LanePlanes planes(in, lanes.block, lanes.uniform);
    const auto fits = hn::And(hn::And(planes.fit(grid, at.x, at.y), hn::Gt(at.P[2], zero())),
                              hn::Gt(lanes.mask, zero()));
    store(hn::IfThenElseZero(fits, set(1.0)), inside);
    const V nowhere = set(std::numeric_limits<double>::quiet_NaN());
    store(hn::IfThenElse(fits, at.x, nowhere), seen);
    store(hn::IfThenElse(fits, at.y, nowhere), seen + 8);
    const std::size_t fitting = hn::CountTrue(D(), fits);
    left = static_cast<std::uint64_t>(lanes.used) - fitting;
    any = fitting > 0;
    if (!any) return;
    const V x = hn::Add(hn::Floor(at.x), set(grid.left - 1.0));
    const V y = hn::Add(hn::Floor(at.y), set(grid.top - 1.0));
    alignas(32) std::int32_t index[kLanes];
    const IndexTag whole;
    hn::Store(hn::DemoteTo(whole, hn::IfThenElseZero(fits, fma(y, planes.stride, x))), whole,
              index);
    for (int l = 0; l < kLanes; ++l) corners.at[l] = planes.origin[l] + index[l];
    corners.stride = planes.strides[0];
    if (!planes.one_stride) copy_windows(grid, planes);
    if (fitting < static_cast<std::size_t>(kLanes)) {
      int one = 0;
      while (inside[one] == 0) ++one;
      for (int l = 0; l < kLanes; ++l)
        if (inside[l] == 0) corners.at[l] = corners.at[one];
    }
    if (planes.one_stride) prefetch(grid);
  }

  /// Planes of different strides: what is read of them is brought together.
  HWY_NOINLINE void copy_windows(const PatchGrid& grid, const LanePlanes& planes) {
    corners.stride = window_stride(grid);
    float* to = windows;
    for (int l = 0; l < kLanes; ++l) {
      const float* from = corners.at[l];
      corners.at[l] = to;
      for (int r = 0; r < grid.rows + 3; ++r, to += corners.stride)
        if (inside[l] != 0) std::copy_n(from + r * planes.strides[l], grid.width + 3, to);
    }
  }

  /// The pixels come from far away, a cache line or two for each row of each patch.
  HWY_INLINE void prefetch(const PatchGrid& grid) const {
    std::ptrdiff_t from = 0;
    for (int r = 0; r < grid.rows + 3; ++r, from += corners.stride)
      for (int l = 0; l < kLanes; ++l) {
        hwy::Prefetch(corners.at[l] + from);
        hwy::Prefetch(corners.at[l] + from + grid.width + 2);
      }
  }
};

/// The sums of a part's patches; zero for those that do not fit.
template <bool kBrightness>
HWY_INLINE void sum_translated_lanes(const PhotometricInput& in, const TranslatedLanes& of,
                                     const Place& at, V alpha, V beta, const double* references,
                                     V* sums) {
  if (!of.any) {
    for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = zero();
    return;
  }
  const PatchGrid& grid = *in.grid;
  const auto fits = hn::Gt(load(of.inside), zero());
  const V x = hn::IfThenElseZero(fits, at.x), y = hn::IfThenElseZero(fits, at.y);
  const V fx = hn::Sub(x, hn::Floor(x)), fy = hn::Sub(y, hn::Floor(y));
  const Look look(in, alpha, beta);
  if (in.taps == Taps::bilinear_central) {
    const bool plain = grid.whole() && grid.width > 2 && !look.weigh;
    (plain ? sum_central<kBrightness, true>
           : sum_central<kBrightness, false>)(grid, of.corners, fx, fy, references, look, sums);
  } else {
    const SpreadTaps across_x(in.taps, fx), across_y(in.taps, fy);
    (in.taps == Taps::catmull_rom ? sum_translated<kBrightness, true>
                                  : sum_translated<kBrightness, false>)(grid, of.corners, across_x,
                                                                        across_y, references, look,
                                                                        sums);
  }
  for (int k = 0; k < kPatchSums<kBrightness>; ++k) sums[k] = hn::IfThenElseZero(fits, sums[k]);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
