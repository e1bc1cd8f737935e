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
  std::string path;     ///< empty: not asked for
  bool model = false;   ///< a problem, which may be a folder
  bool folder = false;  ///< a folder in any case; those that it lies in are made
};

/// Before anything is computed: throws Error (ErrorCode::usage) when two options name one file, or
/// one names an input or a file of an input's folder or of one in it, by any name, and Error
/// (ErrorCode::unwritable_output) when a file cannot be written. inputs: files and folders; empty
/// ones were not given.
void check_outputs(const std::vector<NamedOutput>& outputs,
                   const std::vector<std::string>& inputs = {});

/// Before anything is computed: throws Error (ErrorCode::usage) where `write` would refuse the
/// problem's lenses under this name, and Error (ErrorCode::unwritable_output) where it would refuse
/// the folder of a model. Nothing without a name.
void check_holds(const Problem& problem, const std::string& path);

/// The same of what a solve leaves of the problem, whose lenses are all that `fixed` does not hold.
void check_holds_refined(const Problem& problem, const Fixed& fixed, const std::string& path);

/// Of a file, or of the files of a folder.
std::uint64_t bytes_at(const std::string& path);

/// Writes a text as a whole or not at all. Throws Error.
void write_text(const std::string& text, const std::string& path);

/// A line for each thing that a file of this format does not hold of the problem.
void print_losses(const std::string& format, const Problem& problem);

}  // namespace sheaf
