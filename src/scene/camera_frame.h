// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "sheaf/problem.h"

namespace sheaf {

/// A lens that BAL's formula describes too, once y and z of the camera's frame are turned round and
/// pixels count from the principal point with y up.
struct RadialView {
  double f = 1, k1 = 0, k2 = 0, cx = 0, cy = 0;
  bool has_k1 = false, has_k2 = false;  ///< whether the model has the parameter
  /// Whether refining f, k1 and k2 is refining the model; false for fx and fy that happen to agree.
  bool refinable = true;
};
std::optional<RadialView> radial_view(const Camera& camera);

/// Turns y and z of the camera's frame round, between one that looks along -z with y up and one
/// that looks along +z with y down. Exact, and `back` undoes it bit for bit.
void turn_round(Pose& pose, bool back);

/// Makes every camera a BAL one. Measurements become x - cx, cy - y, rounded where cx or cy is not
/// 0; all else is exact. Errors: usage, naming the first camera that BAL's formula does not
/// describe; the problem is then as it was.
Result<void> to_bal_cameras(Problem& problem);

/// Makes BAL cameras RADIAL ones with the principal point at 0: exact, measurements included
/// (x, -y). The size of the images is twice as far as the measurements reach.
void from_bal_cameras(Problem& problem);

/// The problem with BAL cameras alone: itself, or a copy in `turned`.
Result<const Problem*> with_bal_cameras(const Problem& problem, Problem& turned);
/// The problem without any: itself, or a copy in `turned`.
const Problem* without_bal_cameras(const Problem& problem, Problem& turned);

bool has_bal_cameras(const Problem& problem);
bool has_only_bal_cameras(const Problem& problem);

}  // namespace sheaf
