// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "json_document.h"
#include "options/option_field.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// AxB of two whole numbers, as 60x40; nothing where it is something else.
std::optional<std::pair<std::uint32_t, std::uint32_t>> sides_of(const std::string& text);

/// The options of `covariance` about how well pixels of resting places are known.
struct ProjectionArguments {
  std::string csv, figure, grid = "60x40";
  double distance = 0;
  bool asked() const { return !csv.empty() || !figure.empty(); }
};
std::vector<BoundOption> options_of(ProjectionArguments& arguments);

/// Of one lens, infinitely far away or at a distance.
struct LensProjection {
  std::uint32_t camera;
  ProjectionUncertainty of;
};
/// Of each lens that sees something; at the stated distance too, where there is one.
/// Throws Error (usage): a grid that is none, a camera without an image size.
std::vector<LensProjection> projections(const ProjectionArguments& arguments,
                                        const Problem& problem, const Covariance& of);

std::string projection_csv(const std::vector<LensProjection>& all);
std::string projection_text(const std::vector<LensProjection>& all);
Json projection_json(const std::vector<LensProjection>& all);
/// Writes what the arguments name, and says so.
void write_projections(const ProjectionArguments& arguments, const Problem& problem,
                       const std::vector<LensProjection>& all);

}  // namespace sheaf
