// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// One item of --refine or --fix.
struct RefinementItem {
  enum class Part { points, poses, image, lens, focal, distortion, principal_point, parameter };
  Part part = Part::points;
  std::string parameter;  ///< its name, where the part is one
  std::string who;        ///< a name, a pattern or an id; empty: all
  std::string text;       ///< as it was given
  bool refine = false;
};

/// Cut at commas; a comma behind a backslash belongs to a name.
std::vector<std::string> split_items(std::string_view list);

/// Adds the items of a list; "", or what is wrong with it.
std::string parse_items(const std::string& list, bool refine, std::vector<RefinementItem>& out);

/// Bits of a lens's parameters that an item is about; 0: the model has none of them.
std::uint16_t parameters_of(const RefinementItem& item, CameraModel model);

/// What a name means: images or lenses by index, and whether it is a pattern for several.
struct Named {
  std::vector<std::uint32_t> indices;
  bool pattern = false;
};
/// Images by name, pattern of names, or id (in a file without ids: number from 0). Throws Error.
Named images_named(const RefinementItem& item, const Problem& problem);
/// Lenses by id (likewise), or those of images by name or pattern. Throws Error.
Named lenses_named(const RefinementItem& item, const Problem& problem);

}  // namespace sheaf
