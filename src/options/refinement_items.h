// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// One item of what is refined or fixed.
struct RefinementItem {
  enum class Part {
    points,
    poses,
    image,
    lens,
    focal,
    distortion,
    principal_point,
    parameter,
    sensor
  };
  Part part = Part::points;
  std::string parameter{};  ///< its name, where the part is one
  std::string who{};        ///< a name, a pattern or an id; empty: all
  std::string text{};       ///< as it was given
  bool refine = false;
};

/// Errors: ErrorCode::usage, saying what is expected.
Result<RefinementItem> parse_item(const std::string& text, bool refine);

/// Bits of a lens's parameters that an item is about; 0: the model has none of them.
std::uint16_t parameters_of(const RefinementItem& item, CameraModel model);

/// "--fix pose=7: WHAT".
Error refusal_of(const RefinementItem& item, const std::string& what);

/// What a name means: images or lenses by index, and whether it is a pattern for several.
struct Named {
  std::vector<std::uint32_t> indices;
  bool pattern = false;
};
/// Images by name, pattern of names, or id (in a file without ids: number from 0). Errors:
/// ErrorCode::usage for what the problem does not have.
Result<Named> images_named(const RefinementItem& item, const Problem& problem);
/// Lenses by id (likewise), or those of images by name or pattern. Errors: likewise.
Result<Named> lenses_named(const RefinementItem& item, const Problem& problem);
/// Sensors of rigs by the ids of their cameras (in a problem that states none: by number from 0),
/// or those of images by name or pattern. References are left out, as they never move. Errors:
/// likewise, and for what names references alone.
Result<Named> sensors_named(const RefinementItem& item, const Problem& problem);

}  // namespace sheaf
