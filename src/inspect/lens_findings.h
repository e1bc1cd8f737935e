// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "inspect/finding_list.h"
#include "inspect/lens_reach.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Absurd focal lengths, absurd distortion and lenses that fold back. A lens is in one of these at
/// most, the first that fits.
void check_lenses(const Problem& problem, const std::vector<LensReach>& reaches, FindingList& list);

}  // namespace sheaf
