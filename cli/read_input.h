// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/io.h"
#include "verb.h"

namespace sheaf {

/// A problem, with its hash where a JSON tells of it. A terminal is told how far a long reading is.
/// Throws Error.
InputFile read_input(const std::string& path, const CommonOptions& common);

}  // namespace sheaf
