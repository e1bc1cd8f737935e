// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "sheaf/terms.h"

namespace sheaf {

/// What stays of a list of entries of `width` numbers each.
template <class List, class Stays>
void shorten(List& list, std::size_t width, const Stays& stays) {
  std::size_t to = 0;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (!stays(i / width)) continue;
    if (to != i) list[to] = std::move(list[i]);
    ++to;
  }
  list.resize(to);
}

/// New indices of what stays of a problem, kGone of what leaves. An empty list: nothing changed.
struct NewNumbers {
  static constexpr std::uint32_t kGone = UINT32_MAX;
  std::vector<std::uint32_t> image{}, camera{}, point{};
};

/// Terms name what stays; those that name anything that leaves go too.
void renumber(const NewNumbers& to, Terms& terms);
/// One of them. False where it names something that leaves, and is then in no state to be used.
bool renumber(const NewNumbers& to, GaussianPrior& prior);

}  // namespace sheaf
