// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/token_reader.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace sheaf {
namespace {

/// In runs of 255, so that byte-wide counters cannot overflow and the loop vectorises well.
std::uint64_t count_newlines(const char* p, const char* end) {
  constexpr std::size_t kLanes = 64;
  std::uint64_t count = 0;
  while (static_cast<std::size_t>(end - p) >= kLanes) {
    unsigned char lanes[kLanes] = {};
    const std::size_t rounds =
        std::min<std::size_t>(255, static_cast<std::size_t>(end - p) / kLanes);
    for (std::size_t i = 0; i < rounds; ++i, p += kLanes)
      for (std::size_t j = 0; j < kLanes; ++j) lanes[j] += p[j] == '\n';
    for (unsigned char lane : lanes) count += lane;
  }
  return count + static_cast<std::uint64_t>(std::count(p, end, '\n'));
}

std::string hex_byte(unsigned char c) {
  const char* digits = "0123456789abcdef";
  return {'0', 'x', digits[c >> 4], digits[c & 15]};
}

bool printable(char c) { return c > ' ' && c < '\x7f'; }

}  // namespace

TokenReader::TokenReader(ByteSource& source, std::size_t window_bytes)
    : source_(source), window_bytes_(window_bytes), window_(new char[window_bytes + 1]) {
  p_ = end_ = token_ = window_.get();
  *window_.get() = '\0';
}

/// Forgets what lies before the token, moves the token to the front and reads on behind it. False
/// when that changes nothing: past the end, after an error, or when the token fills the window.
bool TokenReader::slide() {
  if (source_ended_ || source_error_) return false;
  char* const begin = window_.get();
  newlines_passed_ += count_newlines(begin, token_);
  if (token_ > begin) last_passed_ = token_[-1];
  const std::size_t kept = static_cast<std::size_t>(end_ - token_);
  const std::size_t offset = static_cast<std::size_t>(p_ - token_);
  std::memmove(begin, token_, kept);
  token_ = begin;
  p_ = begin + offset;
  end_ = begin + kept;
  std::size_t added = 0;
  if (kept < window_bytes_) {
    const Result<std::size_t> read = source_.read(begin + kept, window_bytes_ - kept);
    if (read.ok()) {
      added = read.value();
      source_ended_ = kept + added < window_bytes_;
    } else {
      source_error_ = read.error();
    }
  }
  end_ += added;
  begin[kept + added] = '\0';
  return added > 0 || source_ended_;
}

bool TokenReader::read_integer_slowly(std::uint64_t& value) {
  do {
    std::uint64_t v = 0;
    const char* p = token_ = p_ = skip_space(token_);
    bool fits = true;
    for (; *p >= '0' && *p <= '9'; ++p) {
      const unsigned digit = static_cast<unsigned>(*p - '0');
      fits = fits && v <= (std::numeric_limits<std::uint64_t>::max() - digit) / 10;
      v = 10 * v + digit;
    }
    const bool ends = p == end_ ? source_ended_ : is_space(*p);
    if (p > token_ && ends && fits) {
      p_ = p;
      value = v;
      return true;
    }
  } while (slide());
  return false;
}

bool TokenReader::read_real_slowly(double& value) {
  do {
    token_ = p_ = skip_space(token_);
    // from_chars knows no leading plus, which printf("%+e") writes.
    const bool plus = *token_ == '+' && token_ + 1 < end_ && token_[1] != '-';
    const auto [end, error] = fast_float::from_chars(token_ + plus, end_, value);
    const bool ends = end == end_ ? source_ended_ : is_space(*end);
    if (error == std::errc() && ends && std::isfinite(value)) {
      p_ = end;
      return true;
    }
  } while (slide());
  return false;
}

bool TokenReader::at_end() {
  token_ = p_ = skip_space(p_);
  while (p_ == end_ && slide()) token_ = p_ = skip_space(p_);
  if (p_ != end_) slide();  // so that the message shows the whole token
  return p_ == end_ && source_ended_ && !source_error_;
}

/// Counted from 1. The end of the text belongs to its last line.
std::uint64_t TokenReader::line() const {
  const std::uint64_t newlines = newlines_passed_ + count_newlines(window_.get(), token_);
  const char before = token_ > window_.get() ? token_[-1] : last_passed_;
  return token_ == end_ && before == '\n' && newlines > 0 ? newlines : newlines + 1;
}

std::string TokenReader::found() const {
  constexpr std::size_t kShown = 40;
  if (token_ == end_) return "the end of the file";
  if (static_cast<std::size_t>(end_ - token_) == window_bytes_ &&
      std::none_of(token_, end_, [](char c) { return is_space(c); }))
    return "a value of more than " + std::to_string(window_bytes_) + " bytes";
  if (!printable(*token_)) return "binary data (byte " + hex_byte(*token_) + ")";
  std::string text = "'";
  const char* p = token_;
  for (; p < end_ && !is_space(*p) && p < token_ + kShown; ++p) {
    if (printable(*p)) {
      text += *p;
    } else {
      text.append("\\").append(hex_byte(*p), 1);
    }
  }
  if (p < end_ && !is_space(*p)) text += "...";
  return text + "'";
}

Error TokenReader::unexpected(const std::string& expected) const {
  if (source_error_) return *source_error_;
  return Error(ErrorCode::unreadable_input, source_.name() + ":" + std::to_string(line()) +
                                                ": found " + found() + ", expected " + expected);
}

}  // namespace sheaf
