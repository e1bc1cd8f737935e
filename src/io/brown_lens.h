// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "sheaf/camera.h"
#include "sheaf/error.h"

namespace sheaf {

/// A perspective lens with Brown's distortion, as most programs have it: three radial coefficients
/// and two tangential ones, of docs/cameras.md's formula.
struct BrownLens {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< pixels
  std::array<double, 3> k{};
  std::array<double, 2> p{};

  /// Up to the last radial coefficient that is not 0.
  int radial_terms() const { return k[2] != 0 ? 3 : k[1] != 0 ? 2 : k[0] != 0 ? 1 : 0; }
  bool tangential() const { return p[0] != 0 || p[1] != 0; }
};

/// A lens that the above describes. Errors: usage, with what of it has no place.
Result<BrownLens> brown_lens(const Camera& camera);

/// Which coefficients a file's lens has. Those that the camera's model has besides stay 0 unless
/// they are asked for.
struct BrownTerms {
  int radial = 0;  ///< how many
  bool tangential = false;
  bool two_focals = false;  ///< fx and fy are free of each other
};

struct CameraOfFile {
  Camera camera;
  ParameterSet unknown = 0;  ///< parameters that the file's lens does not have
};

/// Whether a panorama is twice as wide as high and as large as its images: what formats that scale
/// both angles by the larger side can state.
bool is_whole_panorama(const Camera& camera);

/// The simplest model that holds the lens: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL,
/// RADIAL_K3, OPENCV or FULL_OPENCV. `width` and `height` in pixels.
CameraOfFile camera_of(const BrownLens& lens, const BrownTerms& terms, std::uint64_t width,
                       std::uint64_t height);

}  // namespace sheaf
