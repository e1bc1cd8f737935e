// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "systems/term.h"

namespace sheaf {

/// Terms of poses and lenses alone: positions, rotations, gravity, relative poses, parameters.
/// view: where the state is restated, else null; parameters must not be then.
void add_pose_terms(const Problem& problem, const TermPlaces& places, const BalView* view,
                    std::vector<std::unique_ptr<Term>>& out);

}  // namespace sheaf
