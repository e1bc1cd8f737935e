// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <vector>

#include "io/output_file.h"

namespace sheaf {

/// Formats numbers into a large buffer, so that the file sees few writes.
class TextBuffer {
 public:
  explicit TextBuffer(OutputFile& out) : out_(out), buffer_(kBytes) {}

  template <class Number>
  void put(Number value, char separator) {
    char* const end = buffer_.data() + buffer_.size();
    if (end - p_ < kLongestNumber) flush();
    p_ = std::to_chars(p_, end, value).ptr;
    *p_++ = separator;
  }

  /// Ends a line that has no numbers.
  void end_line() {
    if (buffer_.data() + buffer_.size() == p_) flush();
    *p_++ = '\n';
  }

  void flush() {
    out_.write(buffer_.data(), static_cast<std::size_t>(p_ - buffer_.data()));
    p_ = buffer_.data();
  }

 private:
  static constexpr std::size_t kBytes = 1 << 18;
  static constexpr std::ptrdiff_t kLongestNumber = 32;  // -2.2250738585072014e-308 and a separator

  OutputFile& out_;
  std::vector<char> buffer_;
  char* p_ = buffer_.data();
};

}  // namespace sheaf
