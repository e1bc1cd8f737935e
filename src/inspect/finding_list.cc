// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/finding_list.h"

#include <algorithm>
#include <cstddef>

#include "platform/real_text.h"

namespace sheaf {

void FindingList::add(const char* code, bool grave, const char* of,
                      const std::vector<std::uint64_t>& which, const std::string& words) {
  constexpr std::size_t kMostListed = 1000;
  if (which.empty()) return;
  const auto listed = static_cast<std::ptrdiff_t>(std::min(which.size(), kMostListed));
  findings.push_back(
      {code, grave, which.size(), of, {which.begin(), which.begin() + listed}, words});
}

std::string plural(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string shown(double x) { return few_digits(x, 3); }

}  // namespace sheaf
