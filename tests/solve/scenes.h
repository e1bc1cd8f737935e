// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "sheaf/problem.h"
#include "sheaf/scene.h"

namespace sheaf {

/// 12 images, 600 points, half a pixel of noise.
Scene small_scene();

/// The same where image i looks through lens i / `together`. The lenses that nobody looks through
/// any more stay in the problem if asked for.
Scene shared_lens_scene(std::uint32_t together, bool keep_unused);

/// Largest |dcost / dx_i| / |J_i| over the free parameters, by central differences of `evaluate`,
/// which shares no code with the solver's Jacobians: poses move by their left perturbation, lenses
/// as a whole. Points beyond the first `points` are left out.
double scaled_gradient(const Problem& problem, const Fixed& fixed = {}, std::size_t points = 40);

/// A real problem's path, or "" when it is not there: $SHEAF_DATA/bal, data/bal by default.
std::string real_data(const std::string& name);

}  // namespace sheaf
