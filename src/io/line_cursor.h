// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <string_view>

#include "sheaf/error.h"

namespace sheaf {

/// Walks over the lines of a text, and over the fields of a line, which blanks separate. A byte
/// order mark is no part of the first line.
class LineCursor {
 public:
  LineCursor(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  /// The next line, blank or not; false at the end of the text.
  bool next_line();
  /// The next line that is neither blank nor a comment (#).
  bool next_record();

  std::uint64_t line_number() const { return number_; }  ///< counted from 1
  std::string_view line() const { return line_; }        ///< without its end (\n or \r\n)
  /// With its end.
  std::string_view raw_line() const { return text_.substr(begin_, next_ - begin_); }
  std::string_view rest();                     ///< of the line, blanks at both ends off
  void pass_line() { field_ = line_.size(); }  ///< as if all its fields were read
  bool line_ended();                           ///< whether only blanks are left of it

  /// The next field as a whole; false at the end of the line.
  bool read_word(std::string_view& word);
  /// Moves on to the next field, on this line or a later one; false at the end of the text.
  bool seek_field() {
    while (line_ended())
      if (!next_record()) return false;
    return true;
  }
  /// False where the next field is missing or anything else; `refuse` then says what was found.
  template <class Integer>
  bool read_integer(Integer& value) {
    std::string_view word;
    if (!read_word(word)) return false;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    return error == std::errc() && end == word.data() + word.size();
  }
  bool read_real(double& value);  ///< finite

  /// NAME:LINE: found the field read last, expected that.
  Error refuse(const std::string& expected) const;
  /// NAME:LINE: as it stands.
  Error refuse_as(const std::string& found_and_expected) const {
    return refuse_at(number_, found_and_expected);
  }
  Error refuse_at(std::uint64_t line, const std::string& found_and_expected) const {
    return Error(ErrorCode::unreadable_input,
                 name_ + ":" + std::to_string(line) + ": " + found_and_expected);
  }

 private:
  std::string_view text_, line_, word_;
  std::string name_;
  std::size_t begin_ = 0, next_ = 0;  ///< of text_: this line, the next one
  std::size_t field_ = 0;             ///< of line_
  std::uint64_t number_ = 0;
};

/// A field as a message shows it: in quotes, unprintable bytes in hexadecimal, at most 40 of it.
std::string quoted(std::string_view word);

}  // namespace sheaf
