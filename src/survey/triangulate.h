// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A mark in an image of a problem.
struct Sighting {
  std::uint32_t image = 0;
  std::array<double, 2> pixel{};
};

/// Where the cameras of a problem see each point by its marks, sigmas not regarded: nothing where
/// fewer than two see it, or where it comes to lie behind one of them. The problem's images of rigs
/// are where `Problem::poses` says.
std::vector<std::optional<Vector3<double>>> triangulate(
    const Problem& problem, const std::vector<std::vector<Sighting>>& points);

/// Reprojection less mark, pixels.
std::array<double, 2> mark_residual(const Problem& problem, const Sighting& sighting,
                                    const Vector3<double>& X);

}  // namespace sheaf
