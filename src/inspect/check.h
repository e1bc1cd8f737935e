// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// Something that is wrong with a problem, or may be.
struct Finding {
  std::string code;   ///< "parts", "weak-images", ...: stable, docs/json.md lists them
  bool grave = true;  ///< false: worth a look, and common in good problems
  std::uint64_t count = 0;
  std::string of;                    ///< "images", "points", "observations", "lenses" or "parts"
  std::vector<std::uint64_t> first;  ///< numbers of the first 1000 of them
  std::string words;                 ///< what is wrong, and what to do
};

/// Looks for what makes a problem ill-posed, slow to solve or wrong: parts that nothing joins,
/// images and points with too few measurements, measurements that occur twice, points behind
/// cameras, rays that hardly meet, absurd focal lengths, residuals far off. Grave ones first.
std::vector<Finding> check(const Problem& problem);

}  // namespace sheaf
