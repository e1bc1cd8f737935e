// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "report/patch_comparison.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// What a photometric refinement leaves to show, beside two clouds without observations.
struct PhotometricPart {
  const PatchComparison* comparison = nullptr;
  const std::vector<GreyImage>* images = nullptr;
  const std::vector<Brightness>* brightness = nullptr;  ///< empty: all (1, 0)
};

/// Patches before and after, how they fit, and where in the images they do not.
std::string photometric_section(const PhotometricPart& part);
std::string photometric_words(const PhotometricPart& part);

}  // namespace sheaf
