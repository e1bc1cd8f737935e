// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "json_document.h"
#include "options/option_field.h"
#include "sheaf/io.h"

namespace sheaf {

/// --rigs of the verbs that read a problem.
struct RigsArguments {
  std::string path;  ///< of a rig configuration; empty: none
};
std::vector<BoundOption> options_of(RigsArguments& arguments);

/// Lays the rigs of the file over the problem; says on stderr where sensors sit and how far the
/// images' poses strayed (unless quiet), and adds to the notes what of the file is not used. The
/// same as JSON; null without the option. Throws Error.
Json lay_rigs(const RigsArguments& arguments, InputFile& input, bool quiet);

}  // namespace sheaf
