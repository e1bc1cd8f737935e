// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/survey.h"

namespace sheaf {

/// survey.json, as docs/constraints.md has it. Errors as `read_constraints`.
Result<Constraints> parse_survey_json(const std::string& text, const std::string& name);

/// gcp_list.txt: a line of the coordinates' frame, then x y z, pixel x y, image, name of the point.
Result<Constraints> parse_gcp_list(const std::string& text, const std::string& name);
/// geo.txt: a line of the coordinates' frame, then image x y z, three angles, two accuracies.
Result<Constraints> parse_geo_txt(const std::string& text, const std::string& name);
/// A table of positions with a line of column names.
Result<Constraints> parse_position_table(const std::string& text, const std::string& name);

/// What the files have in common that no reader sees line by line: ids that occur twice, ends of
/// scale bars that are no points. Errors: unreadable_input with file and line.
Result<void> check_constraints(const Constraints& constraints);

}  // namespace sheaf
