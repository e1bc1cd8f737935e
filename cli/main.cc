// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"
#include "verb.h"

int main(int argc, char** argv) { return sheaf::run_command_line(argc, argv, sheaf::all_verbs); }
