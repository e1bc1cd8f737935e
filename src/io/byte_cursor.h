// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "sheaf/error.h"

namespace sheaf {

/// Walks over the bytes of a binary file, little-endian unless told otherwise; never beyond its
/// end.
class ByteCursor {
 public:
  ByteCursor(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  /// False, without moving, where too few bytes are left.
  template <class T>
  bool read(T& value) {
    static_assert(std::is_arithmetic_v<T>);
    if (left() < sizeof(T)) return false;
    last_ = at_;
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    if (big_endian_ != (std::endian::native == std::endian::big))
      std::reverse(raw.begin(), raw.end());
    value = std::bit_cast<T>(raw);
    at_ += sizeof(T);
    return true;
  }

  /// Up to a zero byte, which is passed over too. False where there is none.
  bool read_name(std::string& name) {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos) return false;
    last_ = at_;
    name.assign(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return true;
  }

  /// A count of records, which the rest of the file must be able to hold at this many bytes each;
  /// the error otherwise.
  template <class Count>
  std::optional<Error> read_count(const char* what, std::uint64_t record_bytes, Count& count) {
    if (!read(count)) return truncated(std::string("the number of ") + what);
    if (count <= left() / record_bytes) return {};
    return refuse("found " + std::to_string(count) + " " + what + ", expected at most the " +
                  std::to_string(left() / record_bytes) + " that the rest of the file can hold");
  }
  std::optional<Error> check_end() const {
    if (left() == 0) return {};
    return refuse_at(at_, "found " + std::to_string(left()) +
                              " more bytes, expected the end of the file behind the last record");
  }

  std::uint64_t at() const { return at_; }
  std::uint64_t last() const { return last_; }  ///< where the value read last begins
  std::uint64_t left() const { return bytes_.size() - at_; }
  void big_endian() { big_endian_ = true; }

  /// NAME: byte N: found it, expected that; N is where the value read last begins.
  Error refuse(const std::string& found_and_expected) const {
    return refuse_at(last_, found_and_expected);
  }
  Error refuse_at(std::uint64_t byte, const std::string& found_and_expected) const {
    return Error(ErrorCode::unreadable_input,
                 name_ + ": byte " + std::to_string(byte) + ": " + found_and_expected);
  }
  /// The bytes end before what is expected.
  Error truncated(const std::string& expected) const {
    return refuse_at(bytes_.size(),
                     "found the end of the file, expected " + expected + " (truncated?)");
  }

 private:
  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0, last_ = 0;
  bool big_endian_ = false;
};

}  // namespace sheaf
