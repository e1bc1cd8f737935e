// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/line_cursor.h"

#include <fast_float/fast_float.h>

#include <algorithm>
#include <cmath>

#include "platform/unicode.h"

namespace sheaf {
namespace {

bool blank(char c) { return c == ' ' || c == '\t'; }

}  // namespace

std::string quoted(std::string_view word) {
  constexpr std::size_t kShown = 40;
  const char* digits = "0123456789abcdef";
  std::string out = "'";
  for (const char c : word.substr(0, kShown)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= ' ' && byte < 0x7f) {
      out += c;
    } else {
      out += std::string("\\x") + digits[byte >> 4] + digits[byte & 15];
    }
  }
  return out + (word.size() > kShown ? "...'" : "'");
}

bool LineCursor::next_line() {
  if (next_ >= text_.size()) return false;
  const std::size_t end = std::min(text_.find('\n', next_), text_.size());
  line_ = text_.substr(next_, end - next_);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  if (number_ == 0) line_ = without_mark(line_);
  begin_ = next_;
  next_ = std::min(end + 1, text_.size());
  field_ = 0;
  word_ = {};
  ++number_;
  return true;
}

bool LineCursor::next_record() {
  while (next_line())
    if (const std::string_view text = rest(); !text.empty() && text.front() != '#') return true;
  return false;
}

std::string_view LineCursor::rest() {
  std::string_view out = line_.substr(std::min(field_, line_.size()));
  while (!out.empty() && blank(out.front())) out.remove_prefix(1);
  while (!out.empty() && blank(out.back())) out.remove_suffix(1);
  return out;
}

bool LineCursor::line_ended() {
  while (field_ < line_.size() && blank(line_[field_])) ++field_;
  return field_ >= line_.size();
}

bool LineCursor::read_word(std::string_view& word) {
  word_ = {};
  if (line_ended()) return false;
  const std::size_t begin = field_;
  while (field_ < line_.size() && !blank(line_[field_])) ++field_;
  word = word_ = line_.substr(begin, field_ - begin);
  return true;
}

bool LineCursor::read_real(double& value) {
  std::string_view word;
  if (!read_word(word)) return false;
  // from_chars knows no leading plus, which printf("%+e") writes.
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto [stop, error] = fast_float::from_chars(word.data(), end, value);
  return error == std::errc() && stop == end && std::isfinite(value);
}

Error LineCursor::refuse(const std::string& expected) const {
  const std::string found = word_.empty() ? "the end of the line" : quoted(word_);
  return refuse_as("found " + found + ", expected " + expected);
}

}  // namespace sheaf
