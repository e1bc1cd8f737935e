// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include <optional>

#include "sheaf/survey.h"

namespace sheaf {

namespace nb = nanobind;

/// The keyword `constraints`: None, a dict as survey.json has it, a path, or several of these.
/// Throws Error, and TypeError for anything else.
std::optional<Constraints> constraints_from(nb::handle given);

/// As docs/json.md has `survey`: a dict, or None without one.
nb::object survey_object(const std::optional<Survey>& survey, const SurveyReport* report);

/// A document as Python has it.
nb::object object_of_json(const std::string& text);

}  // namespace sheaf
