// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace sheaf {

struct NamedOutput {
  std::string option;
  std::string path;  ///< empty: not asked for
};

/// Before anything is computed: throws Error (ErrorCode::usage) when two options name one file and
/// Error (ErrorCode::unwritable_output) when a file cannot be written.
void check_outputs(const std::vector<NamedOutput>& outputs);

}  // namespace sheaf
