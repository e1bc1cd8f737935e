// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "io/line_cursor.h"
#include "platform/real_text.h"

namespace sheaf {

/// The fields of a text's lines, which tabs separate, so that blanks are part of them.
class TabFields {
 public:
  TabFields(std::string_view text, std::string name) : in_(text, std::move(name)) {}

  bool next_line() {
    const bool good = in_.next_line();
    rest_ = in_.line();
    left_ = good && !rest_.empty();
    return good;
  }
  std::string_view line() const { return in_.line(); }

  /// The next field; false where there is none, or an empty one.
  bool text(std::string_view& field) {
    field_ = {};
    if (!left_) return false;
    const std::size_t tab = rest_.find('\t');
    field = field_ = rest_.substr(0, tab);
    left_ = tab != rest_.npos;
    rest_ = left_ ? rest_.substr(tab + 1) : std::string_view();
    return !field.empty();
  }
  template <class Integer>
  bool number(Integer& value) {
    std::string_view word;
    if (!text(word)) return false;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
  }
  bool number(double& value) {  ///< finite
    std::string_view word;
    if (!text(word)) return false;
    const auto [end, error] = read_real(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size() && std::isfinite(value);
  }

  /// NAME:LINE: found the field read last, expected that.
  Error refuse(const std::string& expected) const {
    const std::string found = field_.empty() ? "the end of the line" : sheaf::quoted(field_);
    return in_.refuse_as("found " + found + ", expected " + expected);
  }

 private:
  LineCursor in_;
  std::string_view rest_, field_;
  bool left_ = false;
};

}  // namespace sheaf
