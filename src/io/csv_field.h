// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace sheaf {

/// A text as a field of CSV: in quotes where it needs them.
inline std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace sheaf
