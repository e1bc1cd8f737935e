// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "inspect/finding_list.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Parameters of lenses that measurements good to a pixel would not determine, where that is told
/// in a moment; nothing where the state is too bad to tell.
std::optional<Finding> weak_lenses(const Problem& problem, int threads);

}  // namespace sheaf
