// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "page/run_record.h"

namespace sheaf {

/// Positions, control and check points: a map of them with their residuals, and each axis against
/// what was stated. Nothing where there are none.
std::string survey_section(const RunSurvey& survey);
std::string survey_words(const RunSurvey& survey);

}  // namespace sheaf
