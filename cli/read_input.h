// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/io.h"
#include "verb.h"

namespace sheaf {

/// A problem, with its hash where something tells of it: by itself where there is a JSON. A
/// terminal is told how far a long reading is. Throws Error.
InputFile read_input(const std::string& path, const CommonOptions& common, bool hash);
inline InputFile read_input(const std::string& path, const CommonOptions& common) {
  return read_input(path, common, !common.json.empty());
}

}  // namespace sheaf
