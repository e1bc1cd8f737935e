// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/covariance.h"

namespace sheaf {

/// An SVG of how far the pixels of resting places move, px in the worst direction: a shade for each
/// cell of the grid, lines of equal uncertainty with their values, and a bar of the shades. Grey is
/// where the lens sees no direction.
std::string projection_figure(const Camera& camera, const ProjectionUncertainty& of,
                              const std::string& title);

}  // namespace sheaf
