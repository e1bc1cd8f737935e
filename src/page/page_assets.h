// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

namespace sheaf {

/// The report's page as it is written in src/page/assets/: its frame, with names in doubled braces
/// for what is filled in; its style; its script.
std::string_view page_template();
std::string_view page_style();
std::string_view page_script();

}  // namespace sheaf
