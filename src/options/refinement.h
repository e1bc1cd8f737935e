// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "options/option_field.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What of a problem moves and what is held, before there is a problem. By default points, poses,
/// focal lengths, distortion and sensors of rigs move and principal points are held; the items say
/// otherwise, for all images and lenses or for named ones. What names fewer wins: a name over a
/// pattern over all, and a single parameter over its kind over the whole lens.
struct RefinementArguments {
  std::vector<std::string> fix, refine;
  bool given() const { return !refine.empty() || !fix.empty(); }
};

/// The options --fix and --refine; `of_fix` says what the first does.
OptionTable<RefinementArguments> refinement_fields(const std::string& of_fix);

/// What moves, image by image and lens by lens.
struct Refinement {
  bool points = true;
  std::vector<char> poses;            ///< of each image: whether it moves
  std::vector<char> named;            ///< of each image: whether what decided was about some alone
  std::vector<std::uint16_t> lenses;  ///< of each lens: bit k for parameter k
  std::vector<char> sensors;          ///< of each sensor: whether it moves; references never do
};

/// Errors: ErrorCode::usage for a name or id that the problem does not have, a parameter that no
/// lens has, and what is both refined and held.
Result<Refinement> refinement_of(const RefinementArguments& arguments, const Problem& problem);

/// As the solver takes it. Images of a frame that moves several, or a sensor's, are held by their
/// frame: with `poses`, where none of them is named to move; a named one holds its sensor too.
Fixed fixed_of(const Refinement& refinement, const Problem& problem);

/// "points; poses of 3 of 12 images; cx, cy of 1 camera": what is held, or "".
std::string held_text(const Refinement& refinement, const Problem& problem);

}  // namespace sheaf
