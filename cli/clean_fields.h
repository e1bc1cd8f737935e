// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "inspect/clean.h"
#include "options/option_field.h"

namespace sheaf {

/// The options of leaving out what misleads a solver.
const OptionTable<CleanOptions>& clean_fields();

}  // namespace sheaf
