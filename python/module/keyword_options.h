// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <vector>

#include "options/option_field.h"

namespace sheaf {

namespace nb = nanobind;

/// Sets the options that keywords name, in the table's order, each under its `identifier_of`, and
/// takes them out of the keywords. A list also takes a single text, with commas between items.
/// Throws TypeError for a value of a wrong type, Error (usage) for one that the option does not
/// take, for an option without one that it needs, and for one beside one that it excludes.
void take_options(nb::dict& keywords, const std::vector<BoundOption>& options);

/// Throws TypeError, as Python does, where a keyword is left.
void check_all_taken(const nb::dict& keywords, const char* function);

/// "def NAME(BEFORE, *, max_iterations: int = 50, ...) -> RESULT": the defaults are what the
/// options are set to. `before` are parameters, `after` further keywords.
std::string signature_of(const std::string& name, const std::string& before,
                         const std::vector<std::string>& after,
                         const std::vector<BoundOption>& options, const std::string& result);

/// A line for each option, for a docstring.
std::string help_of(const std::vector<BoundOption>& options);

/// Value by identifier.
nb::dict values_of(const std::vector<BoundOption>& options);

/// All but those named.
std::vector<BoundOption> without(std::vector<BoundOption> options,
                                 const std::vector<std::string>& names);

}  // namespace sheaf
