// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "page/run_record.h"

namespace sheaf {

/// How a run went: cost and gradient against steps and time, what was rejected, why it ended.
std::string run_section(const RunRecord& run);
std::string run_words(const RunRecord& run);

/// What made the result, to the letter.
std::string settings_section(const RunRecord& run);

}  // namespace sheaf
