// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "verb.h"

namespace sheaf {

/// The command's manual page, sheaf(1), in the macros of man(7), made from the same tables as the
/// parser and its help: every verb with its arguments, options, defaults and examples.
std::string man_page(const std::vector<Verb>& verbs);

}  // namespace sheaf
