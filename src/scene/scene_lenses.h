// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sheaf/scene.h"

namespace sheaf {

/// Lenses of scenes. All numbers come out of correctly rounded operations: the same bits on every
/// machine.

/// Whether the model is one of the wide ones: fisheyes, FOV, EUCM, UCM, DOUBLE_SPHERE, panoramas.
bool is_fisheye(CameraModel model);

/// Full angle of view. Errors: ErrorCode::usage for a field of view that the model does not have.
Result<double> field_of_view_deg(const LensSceneOptions& options);

/// Lenses of ordinary size with every parameter of their model (of BAL: RADIAL). The first is the
/// same in every scene; the others differ from it by 2% in focal length and 5% in each coefficient.
std::vector<Camera> draw_lenses(CameraModel model, double half_view_rad, std::uint64_t count,
                                std::uint64_t seed);

/// Where the lens sees a point of its camera's frame, as exact as the lens's formula.
std::array<double, 2> portable_pixel(const Camera& camera, const std::array<double, 3>& P);

}  // namespace sheaf
