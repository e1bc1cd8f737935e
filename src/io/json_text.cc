// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/json_text.h"

#include <algorithm>

#include "io/line_cursor.h"
#include "platform/unicode.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

void quote(std::string_view text, std::string& out) {
  constexpr const char* kDigits = "0123456789abcdef";
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out.append("\\u00") += kDigits[c >> 4];
      out += kDigits[c & 15];
    } else {
      out += c;
    }
  }
  out += '"';
}

void state(const JsonValue& value, std::string& out) {
  const char* apart = "";
  switch (value.kind) {
    case Kind::text:
      return quote(value.text, out);
    case Kind::list:
      out += '[';
      for (const JsonValue& item : value.items) {
        out += apart;
        state(item, out);
        apart = ", ";
      }
      out += ']';
      return;
    case Kind::object:
      out += '{';
      for (const JsonMember& member : value.members) {
        out += apart;
        quote(member.name, out);
        out += ": ";
        state(member.value, out);
        apart = ", ";
      }
      out += '}';
      return;
    default:
      out += value.shown();
  }
}

}  // namespace

void JsonText::put_quoted(std::string_view text) { quote(text, out_); }

std::string json_members(const JsonValue& object, std::initializer_list<std::string_view> but) {
  std::string out;
  for (const JsonMember& member : object.members) {
    if (std::find(but.begin(), but.end(), member.name) != but.end()) continue;
    if (!out.empty()) out += ", ";
    quote(member.name, out);
    out += ": ";
    state(member.value, out);
  }
  return out;
}

Result<void> check_json_names(const Problem& problem) {
  if (problem.metadata == nullptr) return {};
  for (const std::string& name : problem.metadata->image_names)
    if (!is_utf8(name))
      return Error(ErrorCode::usage, "the image name " + sheaf::quoted(name) +
                                         " is no UTF-8, which JSON cannot state");
  return {};
}

}  // namespace sheaf
