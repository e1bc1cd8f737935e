// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <numeric>
#include <string>
#include <unordered_map>
#include <vector>

namespace sheaf {

/// Records of a text file of a COLMAP model, each of so many lines, as they are to be written.
struct RecordLines {
  std::string header;  ///< comments of a file that is written anew
  std::size_t count = 0;
  int lines = 1;
  std::function<void(std::size_t record, int line, std::string& out)> format{};
  /// Whether a line says what the source's record `before` says.
  std::function<bool(std::size_t record, std::size_t before, int line)> same{};
};

inline constexpr std::size_t kGoneRecord = SIZE_MAX;

/// The number that each of the records `before` has among those of `now`, or kGoneRecord.
template <class Id>
std::vector<std::size_t> numbers_now(const std::vector<Id>& before, const std::vector<Id>& now) {
  std::vector<std::size_t> out(before.size());
  std::iota(out.begin(), out.end(), std::size_t{0});
  if (before == now) return out;
  std::unordered_map<Id, std::size_t> number;
  for (std::size_t i = 0; i < now.size(); ++i) number.emplace(now[i], i);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto found = number.find(before[i]);
    out[i] = found == number.end() ? kGoneRecord : found->second;
  }
  return out;
}

/// The text anew, header and all.
std::string state(const RecordLines& records);

/// The source's text: its comments and blank lines, each line that still says the same as it stood,
/// the others as `format` has them, without records that are gone, and with new ones at the end.
/// Anew where the records now stand in another order.
std::string restate(const RecordLines& records, const std::string& source,
                    const std::vector<std::size_t>& now);

/// Ends a line whose last field left a blank behind it.
void end_line(std::string& out);
/// Numbers in the shortest form that reads back to the same bits, with a blank behind.
void put_field(std::string& out, double x);
void put_field(std::string& out, std::uint64_t n);

}  // namespace sheaf
