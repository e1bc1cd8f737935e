// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "io/colmap_parts.h"

namespace sheaf {

/// A problem as a COLMAP model states it: every id, name and feature filled in.
struct ColmapForm {
  const Problem* problem = nullptr;  ///< without BAL cameras
  bool unchanged = false;            ///< since it was read
  bool as_read = false;              ///< nor is the format another one
  std::vector<std::uint32_t> camera_ids, image_ids;
  std::vector<std::string> names;
  std::vector<std::uint64_t> point_ids;
  std::vector<std::array<std::uint8_t, 3>> colours;
  std::vector<double> errors_px;
  FeatureTable features;
  /// qw qx qy qz tx ty tz of each image: as stated, where that is the same rotation to all.
  std::vector<std::array<double, 7>> poses;
};

/// `format` is that it will have ("colmap" or "colmap-text").
ColmapForm colmap_form(const Problem& problem, const std::string& format);

std::string cameras_binary(const ColmapForm& form);
std::string images_binary(const ColmapForm& form);
std::string points_binary(const ColmapForm& form);

/// `source` is what was read, or empty; `before` its form. Lines that say the same are written as
/// they stood.
std::string cameras_text(const ColmapForm& form, const std::string& source,
                         const ColmapForm* before);
std::string images_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before);
std::string points_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before);

}  // namespace sheaf
