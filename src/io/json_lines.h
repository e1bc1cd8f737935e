// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sheaf/error.h"

namespace sheaf {

/// A value of a JSON text, with the line where it ends (that of a list or an object: where it
/// begins).
struct JsonMember;
struct JsonValue {
  enum class Kind : std::uint8_t { null, boolean, number, text, list, object } kind = Kind::null;
  bool boolean = false;
  double number = 0;
  std::string text;
  std::vector<JsonValue> items;
  std::vector<JsonMember> members;
  std::uint64_t line = 1;  ///< counted from 1

  /// The member of that name, the last one where there are several; null where there is none.
  const JsonValue* find(const std::string& name) const;
  /// As a message shows it: "a list", "'word'", "1.5".
  std::string shown() const;
};

struct JsonMember {
  std::string name;
  JsonValue value;
};

/// Errors: unreadable_input, NAME:LINE: found ..., expected JSON.
Result<JsonValue> parse_json(const std::string& text, const std::string& name);

}  // namespace sheaf
