// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "geometry/rotation.h"
#include "rows/photometric.h"
#include "rows/reference_row.h"

namespace sheaf {

// What the reference kernels of patches share: one patch in plain scalar code.

/// One lane of one batch.
struct PatchLane {
  const PhotometricInput& in;
  std::size_t group;
  std::uint64_t batch;
  std::uint32_t lane;

  std::uint32_t block() const { return in.batches->image[8 * batch + lane]; }
  std::uint32_t point() const { return in.batches->lane_point[8 * group + lane]; }
  const double* view() const { return in.views + kViewRecord * block(); }
  const GreyPlane& plane() const { return in.planes[in.block_image[block()]]; }
  double alpha() const { return view()[12]; }
  double beta() const { return view()[13]; }
  /// s of P = R d + s t.
  double scale() const { return in.rays == nullptr ? 1 : in.points[24 * group + lane]; }
  /// P, the patch's middle in the camera's frame.
  Vector3<double> middle() const;
  /// P of a pixel of a warped patch, whose depth along the host's ray is the middle's.
  Vector3<double> pixel(double dx, double dy) const;
  std::array<double, 2> project(const Vector3<double>& P) const {
    const Pinhole& k = in.camera;
    return {k.fx * (P[0] / P[2]) + k.cx, k.fy * (P[1] / P[2]) + k.cy};
  }
  /// Whether all of it is in the image.
  bool fits() const;
};

/// The first two rows of the Cholesky factor of a patch's Gram matrix, of the columns gx, gy, alpha
/// and beta, and as much of the residual. Those of a patch that left are 0.
struct PatchFactor {
  double r11 = 0, r12 = 0, r22 = 0;
  std::array<double, 2> h{}, alpha{}, beta{};

  /// A lane of patch_factors(brightness).
  void store(bool brightness, double* to) const;
  static PatchFactor restore(bool brightness, const double* from);
};

/// The patch's two rows: R du / dxi and so on (docs/photometric.md).
PointRow patch_rows(const PatchLane& patch, const PatchFactor& factor);

/// The table of these.
const PhotometricKernels& reference_photometric_kernels();

}  // namespace sheaf
