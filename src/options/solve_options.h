// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "options/option_field.h"
#include "options/refinement.h"
#include "sheaf/error.h"
#include "sheaf/options.h"

namespace sheaf {

/// The options of a solve: each is one entry here and one field of the struct. What is fixed needs
/// the problem (`refinement_fields`); callbacks have no text.
const OptionTable<SolveOptions>& solve_fields();

/// A solve as the command and other languages state it, before there is a problem.
struct SolveArguments {
  SolveOptions options;
  RefinementArguments refinement;
};
std::vector<BoundOption> options_of(SolveArguments& arguments);

/// Errors: ErrorCode::usage, naming the first field that is out of its range.
Result<void> check_fields(const SolveOptions& options);

}  // namespace sheaf
