// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace sheaf {

/// Numbers that fit into a format that has none above `most`: the ids, or else the indices.
template <class Id>
std::vector<std::uint64_t> numbers_of(const std::vector<Id>& ids, std::size_t count,
                                      std::uint64_t most) {
  std::vector<std::uint64_t> out(ids.begin(), ids.end());
  const bool fit =
      std::all_of(out.begin(), out.end(), [=](std::uint64_t id) { return id <= most; });
  if (fit && out.size() == count) return out;
  out.resize(count);
  std::iota(out.begin(), out.end(), std::uint64_t{0});
  return out;
}

}  // namespace sheaf
