// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "io/json_lines.h"

namespace sheaf {

/// Reads a value of JSON after another and keeps the first error; what follows it has no meaning.
class JsonReading {
 protected:
  explicit JsonReading(std::string name) : name_(std::move(name)) {}

  void refuse(const JsonValue& found, const std::string& expected) {
    refuse(found.line, found.shown(), expected);
  }
  void refuse(std::uint64_t line, const std::string& found, const std::string& expected);

  /// Whether the value is an object whose keys are all known, none of them twice.
  bool known(const JsonValue& object, const std::string& what,
             std::initializer_list<std::string_view> keys);

  /// The values of a list, where there is one.
  template <class Read>
  void each(const JsonValue& object, const std::string& key, Read read) {
    const JsonValue* list = object.find(key);
    if (list == nullptr) return;
    if (list->kind != JsonValue::Kind::list) return refuse(*list, "\"" + key + "\": a list");
    for (const JsonValue& value : list->items)
      if (!error_) read(value);
  }

  /// Null where it is missing, which is refused.
  const JsonValue* need(const JsonValue& object, const std::string& key);
  std::string text(const JsonValue& object, const std::string& key);
  /// An id or a name may be a number too.
  std::string name(const JsonValue& object, const std::string& key);
  double number(const JsonValue& object, const std::string& key);
  double above_zero(const JsonValue& object, const std::string& key);
  template <std::size_t kCount>
  std::array<double, kCount> numbers(const JsonValue& list, const std::string& key) {
    std::array<double, kCount> out{};
    const std::string expected =
        "\"" + key + "\": a list of " + std::to_string(kCount) + " finite numbers";
    if (list.kind != JsonValue::Kind::list || list.items.size() != kCount)
      return refuse(list, expected), out;
    for (std::size_t k = 0; k < kCount; ++k) {
      if (list.items[k].kind != JsonValue::Kind::number || !std::isfinite(list.items[k].number))
        refuse(list.items[k], expected);
      out[k] = list.items[k].number;
    }
    return out;
  }

  std::string name_;  ///< of the file
  std::optional<Error> error_;
};

}  // namespace sheaf
