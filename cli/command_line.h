// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "verb.h"

namespace sheaf {

/// Reads the command line, runs the verb that it names and returns the exit code; what is wrong is
/// said on stderr. Signals are watched and streams guarded before anything else is done.
int run_command_line(int argc, char** argv, std::vector<Verb> (*verbs)());

}  // namespace sheaf
