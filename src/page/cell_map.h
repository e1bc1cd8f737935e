// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "page/page_scene.h"

namespace sheaf {

/// The mean residual of each cell of an image, row by row.
struct CellMap {
  int columns = 0, rows = 0;
  std::vector<std::uint64_t> count;
  std::vector<std::array<double, 2>> mean;  ///< px
  std::vector<double> error;                ///< standard error of a component of the mean, px

  /// A cell with fewer residuals tells nothing.
  static constexpr std::uint64_t kFewest = 8;
  /// The root mean square of the means that tell something, px.
  double rms() const;
  /// Longer than four standard errors: by chance in one of thousands.
  bool systematic(std::size_t cell) const;
};

/// Of these images, each cut into the same cells; residuals longer than `clip_px` are left out, for
/// they would be the mean.
CellMap cell_map(const PageScene& scene, const StateNumbers& state,
                 const std::vector<std::uint32_t>& images, int columns, int rows, double clip_px);

/// All images on one another, before and after, and a map of each lens: figures and a part of the
/// page.
std::string cell_charts(const PageScene& scene);
std::string lens_maps(const PageScene& scene);

/// Rows and columns of square cells, about `most` along the longer side.
std::array<int, 2> cells_of(const ImageFrame& frame, int most);

}  // namespace sheaf
