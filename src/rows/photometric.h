// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/loss.h"
#include "image/grey.h"
#include "image/interpolation.h"
#include "lists/batches.h"
#include "rows/row_layout.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// A pattern on a grid. Where each pixel is projected by itself, eight lanes walk it. Wide
/// patterns: a strip is eight columns, lane by lane, and a step is a row. Patterns of up to four
/// columns: the lower four lanes walk the upper half of the rows and the upper four the lower half.
struct PatchGrid {
  int left = 0, top = 0;             ///< least dx and dy
  int width = 0, rows = 0;           ///< extent
  bool narrow = false;               ///< two half patches side by side
  int strips = 0, steps = 0;         ///< strips of so many steps
  std::vector<float> mask;           ///< 1 where the pattern has a pixel, else 0; strip, step, lane
  std::vector<float> dx, dy;         ///< of every cell of `mask`
  std::vector<std::uint32_t> place;  ///< of the pattern's pixel k in `mask`
  std::vector<int> cell_at;  ///< width x rows: where a pixel of the rectangle is in `mask`, or -1
  /// Of every cell of `mask`: where it is in the rectangle, row by row; area() where it has no
  /// pixel.
  std::vector<std::uint32_t> spot;

  std::size_t cells() const { return mask.size(); }
  std::size_t area() const { return cell_at.size(); }
  bool whole() const { return place.size() == area(); }  ///< the pattern is the rectangle
  int right() const { return left + width - 1; }
  int bottom() const { return top + rows - 1; }
};
PatchGrid make_grid(const Pattern& pattern);

/// Whether a patch whose middle is at (x, y) lies in the image with one pixel around it, which
/// its slopes need. False for what is not finite.
inline bool patch_fits(const PatchGrid& grid, const GreyPlane& plane, double x, double y) {
  return x + grid.left >= 1 && x + grid.right() <= plane.width() - 2 && y + grid.top >= 1 &&
         y + grid.bottom() <= plane.height() - 2;
}

/// Likewise of one pixel.
inline bool pixel_fits(const GreyPlane& plane, double x, double y) {
  return x >= 1 && x <= plane.width() - 2 && y >= 1 && y <= plane.height() - 2;
}

/// What does not move while poses, points and brightness do.
struct PatchScene {
  Pinhole camera;
  std::vector<GreyPlane> planes;  ///< by image
  PatchGrid grid;
  std::vector<float> references;    ///< grid.cells() per point
  std::vector<std::uint32_t> host;  ///< by point, or empty: points in the world
  std::vector<double> rays;         ///< 3 per point with hosts: (x, y, 1)
  Taps taps = Taps::catmull_rom;
  bool warped = false;  ///< each pixel is projected by itself, at the depth of the patch's middle

  std::size_t num_images() const { return planes.size(); }
  bool has_rays() const { return !rays.empty(); }
};

/// What moves.
struct PatchState {
  std::vector<Pose> poses;
  std::vector<Brightness> brightness;
  std::vector<double> points;  ///< 3 per point: X, Y, Z; with rays the inverse depth, 0, 0
};

/// A patch in an image.
struct Sight {
  std::uint32_t point, image;
};

/// Where a sight's patch has its middle in its image, pixels; a depth of 0 or less is behind.
struct PatchPlace {
  double x, y, depth;
};
/// (dx, dy): of a pixel of a warped patch.
PatchPlace place_patch(const PatchScene& scene, const PatchState& state, const Sight& sight,
                       int dx = 0, int dy = 0);
bool is_seen(const PatchScene& scene, const PatchState& state, const Sight& sight);

/// The brightness (alpha, beta) that takes a sight's reference to its image.
Brightness relative_brightness(const PatchScene& scene, const PatchState& state,
                               const Sight& sight);

/// r = I - (alpha g + beta) of a sight's pixels, in the pattern's order, by plain scalar code: the
/// kernels' twin. False where the patch is outside; `out` is then as it was.
bool patch_residuals(const PatchScene& scene, const PatchState& state, const Sight& sight,
                     std::vector<double>& out);

/// How a camera block sees points: 24 doubles, R (9, row-major), t (3), alpha, beta, 10 unused. A
/// point is at P = R d + s t: with world points d = X and s = 1; with host rays d = (x, y, 1), s is
/// the inverse depth and (R, t) leads from the host to the target. The patch's grey level g looks
/// like alpha g + beta in the image.
constexpr std::size_t kViewRecord = 24;
namespace view_record {
constexpr int kAlpha = 12, kBeta = 13;
constexpr int kOctets = 2;  ///< eights to read
}  // namespace view_record

/// Patches arranged in batches: what Batches calls an image is a camera block here.
struct PhotometricInput {
  const Batches* batches;
  const GreyPlane* planes;           ///< by image
  const std::uint32_t* block_image;  ///< image that a block looks into
  const double* views;               ///< kViewRecord per block
  const double* points;              ///< 24 per group: X, Y, Z of the lanes; s alone with rays
  const double* rays;                ///< 24 per group: d of the lanes; nullptr: world points
  const float* references;           ///< grid->cells() per point, in the order of the grid
  const PatchGrid* grid;
  const double* leaving;  ///< 16 per batch: cost of a patch that left, then its sum of squares;
                          ///< nullptr: nothing
  Pinhole camera;
  Taps taps;
  ScaledLoss loss;
  bool loss_per_patch;
  bool brightness;  ///< alpha and beta have columns
  bool warped;      ///< each pixel is projected by itself; with rays only
};

/// Of the brightness alone, with what the rows hold taken out: 8 doubles a lane's field, five
/// fields a batch: (alpha, alpha), (alpha, beta), (beta, beta), then J^T r of both.
constexpr std::size_t kBrightnessBatch = 5 * 8;

/// Doubles of a batch's factors, 8 lanes each: r11, r12, r22, h1 and h2 (R and h of the patch's two
/// rows); with brightness columns the rows' two entries by alpha and two by beta. With the state
/// that the patch was read at they are its rows, in a fifth of the room.
constexpr std::size_t patch_factors(bool brightness) { return (brightness ? 9 : 5) * 8; }

/// Squared slopes of a patch, summed, below which there is no texture: where an image is saturated
/// they are some 1e-28, and points that see nothing else would step by noise over noise.
constexpr double kNoTexture = 1e-12;
/// And what is left of those along y when those along x are known, by their sum, that is rounding.
constexpr double kRoundedPivot = 1e-12;

/// What is nullptr is not written.
struct PhotometricOutput {
  double* rows;        ///< kRowBatch per batch
  double* factors;     ///< patch_factors(brightness) per batch
  double* brightness;  ///< kBrightnessBatch per batch; not written without brightness columns
  double* seen;        ///< 16 per batch: x of the patch's middle in the image, then y; NaN: left.
                       ///< Always written
  double* costs;       ///< 16 per batch: rho of the patch, then its sum of squares
  double cost = 0;     ///< sum of rho over patches, 2 x the cost
  double square_sum = 0;   ///< sum of squared residuals
  std::uint64_t left = 0;  ///< patches outside
};

/// One instruction set's kernel: the patches of groups [first, end) at the state given. A patch's
/// pixels collapse to the Gram matrix of (gx, gy, -g, -1) and the residual r = I - (alpha g +
/// beta), weighted by the loss; its Cholesky factor's first two rows times the geometry are the
/// patch's two rows (docs/photometric.md).
struct PhotometricKernels {
  const char* name;
  void (*collapse)(const PhotometricInput&, std::uint32_t first, std::uint32_t end,
                   PhotometricOutput& out);
};
/// simd_name: as of Kernels (eliminate/kernels.h); "scalar" gives plain scalar code, one pixel at a
/// time, the twin that the others are tested against (rows/reference_patch.h).
const PhotometricKernels& photometric_kernels(const char* simd_name);

}  // namespace sheaf
