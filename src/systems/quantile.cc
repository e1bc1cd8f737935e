// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/quantile.h"

#include <algorithm>
#include <cmath>

namespace sheaf {

QuantileSearch::QuantileSearch(double quantile, std::uint64_t count) {
  const double rank = std::ceil(quantile * static_cast<double>(count));
  rank_ = rank > 1 ? std::min(count, static_cast<std::uint64_t>(rank)) - 1 : 0;
  if (count == 0) shift_ = -1;
}

void QuantileSearch::narrow(const DigitCounts& counts) {
  std::uint64_t digit = 0;
  while (digit + 1 < counts.size() && rank_ >= counts[digit]) rank_ -= counts[digit++];
  prefix_ = prefix_ << kBits | digit;
  shift_ -= kBits;
}

void sum_of(const std::vector<DigitCounts>& parts, DigitCounts& sum) {
  sum.clear();
  for (const DigitCounts& part : parts) {
    sum.resize(std::max(sum.size(), part.size()));
    for (std::size_t i = 0; i < part.size(); ++i) sum[i] += part[i];
  }
}

DigitCounts sum_of(const std::vector<DigitCounts>& parts) {
  DigitCounts sum;
  sum_of(parts, sum);
  return sum;
}

}  // namespace sheaf
