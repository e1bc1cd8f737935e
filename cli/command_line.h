// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "verb.h"

namespace sheaf {

/// Reads the command line, runs the verb that it names and returns the exit code; what is wrong is
/// said on stderr.
int run_command_line(int argc, char** argv, const std::vector<Verb>& verbs);

}  // namespace sheaf
