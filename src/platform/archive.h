// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace sheaf {

/// Numbers behind one another as this machine holds them. What a struct consists of is said once,
/// in a function `archive(a, struct)` that calls a(field, field, ...): a writer appends the fields,
/// a reader sets them.
class ArchiveWriter {
 public:
  template <class... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    else
      archive(*this, const_cast<T&>(value));
  }
  template <class T, std::size_t kCount>
  void put(const std::array<T, kCount>& values) {
    for (const T& value : values) put(value);
  }
  template <class T>
  void put(const std::optional<T>& value) {
    put(value.has_value());
    if (value) put(*value);
  }
  void put(const std::string& text) { put_all(text); }
  template <class T>
  void put(const std::vector<T>& values) {
    put_all(values);
  }
  template <class List>
  void put_all(const List& values) {
    put(static_cast<std::uint64_t>(values.size()));
    if constexpr (std::is_arithmetic_v<typename List::value_type>)
      bytes_.append(reinterpret_cast<const char*>(values.data()),
                    values.size() * sizeof(typename List::value_type));
    else
      for (const auto& value : values) put(value);
  }

  std::string bytes_;
};

/// What bytes say that may be anything: nothing is allocated beyond what they can hold, and from
/// the first field on that is not there or makes no sense nothing is set.
class ArchiveReader {
 public:
  explicit ArchiveReader(std::string_view bytes) : bytes_(bytes) {}

  template <class... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
  }
  /// Whether all was read and nothing is left.
  bool complete() const { return ok_ && bytes_.empty(); }

 private:
  template <class T>
  void get(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t byte = 0;
      get(byte);
      if (byte > 1) fail();
      value = byte == 1;
    } else if constexpr (std::is_arithmetic_v<T>) {
      if (!has(sizeof value)) return;
      std::memcpy(&value, bytes_.data(), sizeof value);
      bytes_.remove_prefix(sizeof value);
    } else if constexpr (std::is_enum_v<T>) {
      // Whether it is one of the names is for the caller to know.
      std::underlying_type_t<T> number{};
      get(number);
      value = static_cast<T>(number);
    } else {
      archive(*this, value);
    }
  }
  template <class T, std::size_t kCount>
  void get(std::array<T, kCount>& values) {
    for (T& value : values) get(value);
  }
  template <class T>
  void get(std::optional<T>& value) {
    bool there = false;
    get(there);
    value.reset();
    if (there && ok_) get(value.emplace());
  }
  void get(std::string& text) { get_all(text); }
  template <class T>
  void get(std::vector<T>& values) {
    get_all(values);
  }
  template <class List>
  void get_all(List& values) {
    using T = typename List::value_type;
    std::uint64_t count = 0;
    get(count);
    values.clear();
    constexpr std::size_t kLeast = std::is_arithmetic_v<T> ? sizeof(T) : 1;
    if (!ok_ || count > bytes_.size() / kLeast) return fail();
    if constexpr (std::is_arithmetic_v<T>) {
      values.resize(count);
      if (count > 0) std::memcpy(values.data(), bytes_.data(), count * sizeof(T));
      bytes_.remove_prefix(count * sizeof(T));
    } else {
      for (std::uint64_t k = 0; k < count && ok_; ++k) get(values.emplace_back());
    }
  }
  void fail() { ok_ = false; }
  bool has(std::size_t size) {
    if (!ok_ || bytes_.size() < size) ok_ = false;
    return ok_;
  }

  std::string_view bytes_;
  bool ok_ = true;
};

/// Whether fields are those that a writer wrote: told without allocating anything.
class ArchiveComparison {
 public:
  explicit ArchiveComparison(std::string_view bytes) : bytes_(bytes) {}

  template <class... Fields>
  void operator()(const Fields&... fields) {
    (compare(fields), ...);
  }
  /// Whether all fields were the same and nothing is left.
  bool same() const { return same_ && bytes_.empty(); }

 private:
  template <class T>
  void compare(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
      compare_bytes(&value, sizeof value);
    else if (same_)
      archive(*this, const_cast<T&>(value));
  }
  template <class T, std::size_t kCount>
  void compare(const std::array<T, kCount>& values) {
    for (const T& value : values) compare(value);
  }
  template <class T>
  void compare(const std::vector<T>& values) {
    compare(static_cast<std::uint64_t>(values.size()));
    if constexpr (std::is_arithmetic_v<T>)
      compare_bytes(values.data(), values.size() * sizeof(T));
    else
      for (const T& value : values) compare(value);
  }
  void compare_bytes(const void* bytes, std::size_t size) {
    if (!same_ || bytes_.size() < size) {
      same_ = false;
      return;
    }
    same_ = size == 0 || std::memcmp(bytes_.data(), bytes, size) == 0;
    bytes_.remove_prefix(size);
  }

  std::string_view bytes_;
  bool same_ = true;
};

}  // namespace sheaf
