// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// What only one format can hold, kept for writing the same format again.
struct SourceFiles {
  std::string format;  ///< "colmap", "colmap-text", "bundler", "nvm", "libmv"

  /// COLMAP, text only: the files as they were, so that what was not changed is written as it
  /// stood, comments and number of digits included.
  std::string cameras, images, points;
  /// COLMAP, either form: as they were; empty when the model has none.
  std::string rigs, frames;

  /// Bundler: all images of the file's list, those that were never placed included.
  std::uint32_t listed_images = 0;
  /// NVM: the radial coefficient of each image, with which its measurements were made straight,
  /// these as they were (2 for each observation), and the images' centres.
  std::vector<double> nvm_distortion, nvm_measured, nvm_centres;
  /// libmv: of the markers, 'P' (pixels) or 'N' (normalised).
  char libmv_space = 'P';
};

}  // namespace sheaf
