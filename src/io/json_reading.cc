// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/json_reading.h"

#include <algorithm>
#include <set>

#include "io/line_cursor.h"

namespace sheaf {

using Kind = JsonValue::Kind;

void JsonReading::refuse(std::uint64_t line, const std::string& found,
                         const std::string& expected) {
  if (!error_)
    error_ = Error(ErrorCode::unreadable_input, name_ + ":" + std::to_string(line) + ": found " +
                                                    found + ", expected " + expected);
}

bool JsonReading::known(const JsonValue& object, const std::string& what,
                        std::initializer_list<std::string_view> keys) {
  if (object.kind != Kind::object) return refuse(object, what + ": an object"), false;
  std::set<std::string> seen;
  for (const auto& [key, value] : object.members) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      std::string all;
      for (const std::string_view k : keys) all += (all.empty() ? "" : ", ") + std::string(k);
      return refuse(value.line, "the key " + sheaf::quoted(key), "one of " + what + ": " + all),
             false;
    }
    if (!seen.insert(key).second)
      return refuse(value.line, "the key " + sheaf::quoted(key) + " twice", "it once"), false;
  }
  return true;
}

const JsonValue* JsonReading::need(const JsonValue& object, const std::string& key) {
  const JsonValue* value = object.find(key);
  if (value == nullptr) refuse(object.line, "no \"" + key + "\"", "one in this object");
  return value;
}

std::string JsonReading::text(const JsonValue& object, const std::string& key) {
  const JsonValue* value = need(object, key);
  if (value == nullptr) return {};
  if (value->kind != Kind::text || value->text.empty())
    refuse(*value, "\"" + key + "\": a text that is not empty");
  return value->text;
}

std::string JsonReading::name(const JsonValue& object, const std::string& key) {
  const JsonValue* value = need(object, key);
  if (value == nullptr) return {};
  return value->kind == Kind::number ? value->shown() : text(object, key);
}

double JsonReading::number(const JsonValue& object, const std::string& key) {
  const JsonValue* value = need(object, key);
  if (value == nullptr) return 0;
  if (value->kind != Kind::number || !std::isfinite(value->number))
    refuse(*value, "\"" + key + "\": a finite number");
  return value->number;
}

double JsonReading::above_zero(const JsonValue& object, const std::string& key) {
  const double x = number(object, key);
  if (!error_ && !(x > 0)) refuse(*object.find(key), "\"" + key + "\" above 0");
  return x;
}

}  // namespace sheaf
