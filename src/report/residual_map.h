// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "image/image.h"
#include "report/patch_comparison.h"
#include "sheaf/error.h"

namespace sheaf {

/// An image in pale grey, twice side by side, with a dot in the middle of every patch that it
/// shows, coloured by the patch's rms: before on the left, after on the right.
struct ResidualMap {
  std::string svg;        ///< a file's text, the images' pixels a picture in it
  Image image{0, 0, {}};  ///< the picture: one panel's pixels
  int left_before = 0, left_after = 0, top = 0;  ///< of the two panels
  int zoom = 1, shrink = 1;                      ///< a panel's pixels: zoom / shrink of an image's

  /// Along one axis from a place in the image to one in its panel.
  double placed(double at) const { return (at + 0.5) * zoom / shrink - 0.5; }
};

/// The rms that nine in ten patches before stay below: the full colour of every map.
double rms_scale(const PatchComparison& comparison);

/// Errors: as encode_png.
Result<ResidualMap> draw_residual_map(const PatchComparison& comparison, const GreyImage& grey,
                                      std::uint32_t image, double scale);

}  // namespace sheaf
