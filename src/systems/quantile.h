// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace sheaf {

/// How many values have each digit at one place. Empty: none.
using DigitCounts = std::vector<std::uint64_t>;

/// Finds an order statistic of non-negative doubles that are nowhere stored, in five passes over
/// them: their bit patterns are ordered as they are, and each pass finds 13 bits of the one looked
/// for by counting. Exact, and the same whoever counts which values. NaN counts as the largest.
class QuantileSearch {
 public:
  /// The smallest value that at least quantile x count of the values do not exceed; 0 of none.
  QuantileSearch(double quantile, std::uint64_t count);

  bool done() const { return shift_ < 0; }

  /// Makes room for the counts of a pass, with nothing counted.
  static void clear(DigitCounts& counts) { counts.assign(kDigits, 0); }
  /// Counts one value of a pass; counts is made large enough by the first.
  void count(double value, DigitCounts& counts) const {
    if (counts.empty()) counts.resize(kDigits);
    const auto bits = std::bit_cast<std::uint64_t>(value);
    if ((bits >> shift_) >> kBits == prefix_) ++counts[(bits >> shift_) & (kDigits - 1)];
  }

  /// After all values were counted once.
  void narrow(const DigitCounts& counts);

  double value() const { return std::bit_cast<double>(prefix_); }

 private:
  static constexpr int kBits = 13;
  static constexpr std::uint64_t kDigits = std::uint64_t(1) << kBits;

  std::uint64_t rank_;        ///< among those that share the prefix
  std::uint64_t prefix_ = 0;  ///< the bits above shift_ + kBits
  int shift_ = 52;
};

DigitCounts sum_of(const std::vector<DigitCounts>& parts);
/// Allocates nothing where `sum` was of such counts before.
void sum_of(const std::vector<DigitCounts>& parts, DigitCounts& sum);

}  // namespace sheaf
