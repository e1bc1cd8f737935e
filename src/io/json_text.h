// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "io/json_lines.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A JSON text as it is written, value by value; commas come by themselves. Numbers in the shortest
/// form that reads back to the same bits. Objects and lists of `open` have a line for each member.
class JsonText {
 public:
  void open(char bracket) {  ///< '{' or '['
    begin();
    out_ += bracket;
    ++depth_;
    first_ = true;
  }
  void close(char bracket) {
    --depth_;
    if (!first_) end_line();
    out_ += bracket;
    first_ = false;
  }
  void key(std::string_view name) {
    next();
    put_quoted(name);
    out_ += ": ";
    keyed_ = true;
  }
  void put(std::string_view text) {
    begin();
    put_quoted(text);
  }
  template <class Number>
  requires std::integral<Number> || std::floating_point<Number>
  void put(Number value) {
    begin();
    char buffer[40];
    out_.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
  }
  /// Members or values as `json_members` gives them; none of an empty text.
  void put_raw(std::string_view members) {
    if (members.empty()) return;
    begin();
    out_ += members;
  }
  /// On one line.
  template <class Numbers>
  void list(const Numbers& numbers) {
    begin();
    out_ += '[';
    const char* apart = "";
    for (const auto& x : numbers) {
      char buffer[40];
      out_.append(apart).append(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr);
      apart = ", ";
    }
    out_ += ']';
  }
  template <class Value>
  void member(std::string_view name, const Value& value) {
    key(name);
    put(value);
  }
  template <class Numbers>
  void list_member(std::string_view name, const Numbers& numbers) {
    key(name);
    list(numbers);
  }
  std::string take() { return std::move(out_) + "\n"; }

 private:
  /// Before a value: what stands behind a key stands on its line.
  void begin() {
    if (!keyed_ && depth_ > 0) next();
    keyed_ = false;
  }
  void next() {
    if (!first_) out_ += ',';
    end_line();
    first_ = false;
  }
  void end_line() { out_.append("\n").append(static_cast<std::size_t>(depth_), ' '); }
  void put_quoted(std::string_view text);

  std::string out_;
  int depth_ = 0;
  bool first_ = true, keyed_ = false;
};

/// The members of an object that are none of these, as they stand between its braces; numbers as
/// doubles. Empty where there are no others.
std::string json_members(const JsonValue& object, std::initializer_list<std::string_view> but);

/// Errors: usage, for a name of an image that is no UTF-8, which JSON cannot state.
Result<void> check_json_names(const Problem& problem);

}  // namespace sheaf
