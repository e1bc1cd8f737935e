// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "read_input.h"

#include "live_line.h"
#include "outputs.h"
#include "platform/transfers.h"

namespace sheaf {

InputFile read_input(const std::string& path, const CommonOptions& common, bool hash) {
  const Activity reading(common.quiet, "reading " + path, &transfers.read, bytes_at(path));
  return read_file(path, {.hash = hash}).value();
}

}  // namespace sheaf
