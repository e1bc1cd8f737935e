// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <iterator>
#include <string>

namespace sheaf {

/// "a, b, c", or "a, b or c" with " or " as what comes before the last.
template <class Words>
std::string listed(const Words& words, const char* last = ", ") {
  std::string out;
  for (auto word = words.begin(); word != words.end(); ++word) {
    if (word != words.begin()) out += std::next(word) == words.end() ? last : ", ";
    out += *word;
  }
  return out;
}

}  // namespace sheaf
