// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Where the nine columns of each image's camera block (rho, phi, f, k1, k2) stand in the reduced
/// camera system. Fixed columns stand nowhere; images that share a lens share its columns.
struct Columns {
  static constexpr std::int32_t kFixed = -1;
  std::vector<std::int32_t> of_image;  ///< 9 per image
  std::int32_t count = 0;
  bool lens_shared = false;  ///< some lens with a free parameter serves several images

  std::size_t num_images() const { return of_image.size() / 9; }
  const std::int32_t* image(std::size_t i) const { return &of_image[9 * i]; }
};

/// held: of each camera, which of f, k1, k2 are fixed.
Columns number_columns(const Problem& problem, const Fixed& fixed,
                       const std::vector<ParameterSet>& held);
/// Of a problem whose cameras are all BAL's.
Columns number_columns(const Problem& problem, const Fixed& fixed);

}  // namespace sheaf
