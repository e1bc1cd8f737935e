// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fast_float/fast_float.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/byte_source.h"
#include "sheaf/error.h"

namespace sheaf {

/// Numbers separated by white space (blank, \t \n \v \f \r), read through a window that slides
/// over the text, so that a text of any size needs only the window. A number must fit into it.
class TokenReader {
 public:
  static constexpr std::size_t kWindowBytes = 1 << 18;

  explicit TokenReader(ByteSource& source, std::size_t window_bytes = kWindowBytes);

  /// Decimal digits without a sign. False when the next token is anything else (end of the text
  /// and values of 2^64 and more included); `unexpected` then describes it.
  bool read_integer(std::uint64_t& value) {
    std::uint64_t v = 0;
    const char* p = skip_space(p_);
    token_ = p;
    for (unsigned digit; (digit = static_cast<unsigned char>(*p) - '0') < 10; ++p)
      v = 10 * v + digit;
    const std::size_t digits = static_cast<std::size_t>(p - token_);
    if (digits == 0 || digits > 19 || !is_space(*p)) [[unlikely]]
      return read_integer_slowly(value);
    p_ = p;
    value = v;
    return true;
  }

  /// A decimal floating-point number, rounded to the nearest double; false when the next token is
  /// anything else or not finite as a double.
  bool read_real(double& value) {
    token_ = skip_space(p_);
    const auto [end, error] = fast_float::from_chars(token_, end_, value);
    // At end_ stands a zero byte, which is no white space: a number cut there goes the slow way.
    if (error != std::errc() || !is_space(*end) || !std::isfinite(value)) [[unlikely]]
      return read_real_slowly(value);
    p_ = end;
    return true;
  }

  /// Whether only white space is left. False on a read error too; `unexpected` then tells it.
  bool at_end();

  /// The error of the token read last: FILE:LINE: found it, expected `expected`; or why the bytes
  /// could not be read at all.
  Error unexpected(const std::string& expected) const;

 private:
  static bool is_space(char c) { return c == ' ' || static_cast<unsigned char>(c - '\t') < 5; }
  static const char* skip_space(const char* p) {
    while (is_space(*p)) ++p;
    return p;
  }
  bool read_integer_slowly(std::uint64_t& value);
  bool read_real_slowly(double& value);
  bool slide();
  std::uint64_t line() const;
  std::string found() const;

  ByteSource& source_;
  std::size_t window_bytes_;
  std::unique_ptr<char[]> window_;
  const char* p_;      ///< next byte to look at
  const char* end_;    ///< of what the window holds; a zero byte stands there
  const char* token_;  ///< start of the token read last
  bool source_ended_ = false;
  std::optional<Error> source_error_;
  std::uint64_t newlines_passed_ = 0;  ///< before the window
  char last_passed_ = '\n';            ///< the byte before the window
};

}  // namespace sheaf
