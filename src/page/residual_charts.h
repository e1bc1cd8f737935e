// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "page/page_scene.h"

namespace sheaf {

/// Charts of a scene's residuals, as figures of the page. The result is drawn in ink, the start in
/// grey on the same axes; what Gaussian noise of `PageScene::sigma`, above 0, would do is dashed.

/// Both components of every residual.
std::string distribution_chart(const PageScene& scene);
/// The share of residuals that are longer than x, on logarithmic axes.
std::string tail_chart(const PageScene& scene);
/// Density of residual vectors.
std::string direction_chart(const PageScene& scene);
/// Mean and size against the distance from the principal point.
std::string radial_chart(const PageScene& scene);

/// Whether two states differ so little that they are one on a chart.
bool looks_same(const PageScene& scene);

/// The share of the result's residuals that are longer than so many sigmas.
double share_beyond(const StateNumbers& state, double length_px);

}  // namespace sheaf
