// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "page/page_scene.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// Lenses before and after: distortion, parameters with their sigmas and correlations, and how well
/// they know where they look. known: null where no covariances are.
std::string lens_section(const PageScene& scene, const Covariance* known);

/// What the margin says of them.
std::string lens_words(const PageScene& scene);

}  // namespace sheaf
