// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace sheaf {

/// docs/options.md: every option of the tables, as Markdown.
std::string options_page();

}  // namespace sheaf
