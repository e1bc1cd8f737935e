// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

struct NamedOutput {
  std::string option;
  std::string path;    ///< empty: not asked for
  bool model = false;  ///< a problem, which may be a folder
};

/// Before anything is computed: throws Error (ErrorCode::usage) when two options name one file and
/// Error (ErrorCode::unwritable_output) when a file cannot be written.
void check_outputs(const std::vector<NamedOutput>& outputs);

/// Of a file, or of the files of a folder.
std::uint64_t bytes_at(const std::string& path);

/// Writes a text as a whole or not at all. Throws Error.
void write_text(const std::string& text, const std::string& path);

/// A line for each thing that a file of this format does not hold of the problem.
void print_losses(const std::string& format, const Problem& problem);

}  // namespace sheaf
