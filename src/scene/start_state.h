// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "scene/tracks.h"

namespace sheaf {

/// One state of a scene: truth, or the disturbed start.
struct ViewState {
  Vector3<double> angle_axis{}, translation{}, intrinsics{};
  Matrix3<double> rotation{};
};

/// By place in the file.
std::vector<ViewState> true_states(const Layout& layout);
std::vector<ViewState> start_states(const Layout& layout, const FamilyOptions& options);

/// Where the start has the point: moved with the surroundings of the image that it was found in,
/// then along that image's ray, by as much as a wrong pixel would put it there in a triangulation.
Vector3<double> start_point(const Layout& layout, const FamilyOptions& options, std::uint64_t i,
                            const Track& track);

/// The BAL camera's pixel; `behind` tells whether the point lies behind it.
std::array<double, 2> project(const ViewState& state, const Vector3<double>& X, bool& behind);

}  // namespace sheaf
