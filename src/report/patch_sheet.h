// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/image.h"
#include "report/patch_comparison.h"
#include "sheaf/error.h"

namespace sheaf {

/// A patch on a sheet: pixel k of the pattern is the square of `zoom` pixels at
/// x + zoom (dx_k - least dx), y + zoom (dy_k - least dy), its grey level g the shade
/// 255 (g - low) / (high - low), within 0 to 255.
struct SheetCell {
  enum class Kind { reference, before, after };
  std::uint32_t point = 0;
  std::uint32_t image = 0;  ///< of a reference 0
  Kind kind = Kind::reference;
  int x = 0, y = 0, zoom = 0;
  double low = 0, high = 0;
};

/// A row for each point: the reference, then by image what it shows, above before and below after,
/// each beside its residuals in colour.
struct PatchSheet {
  std::string svg;        ///< a file's text, the patches' pixels a picture below the words
  Image image{0, 0, {}};  ///< the picture
  std::vector<SheetCell> cells;
};

/// Errors: as encode_png.
Result<PatchSheet> draw_patch_sheet(const PatchComparison& comparison,
                                    const std::vector<PatchFit>& rows, const std::string& title);

}  // namespace sheaf
