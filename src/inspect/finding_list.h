// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sheaf {

/// Something that is wrong with a problem, or may be.
struct Finding {
  std::string code;   ///< "parts", "weak-images", ...: stable, docs/json.md lists them
  bool grave = true;  ///< false: worth a look, and common in good problems
  std::uint64_t count = 0;
  std::string of;  ///< "images", "points", "observations", "lenses", "frames", ...
  std::vector<std::uint64_t> first;  ///< numbers of the first 1000 of them
  std::string words;                 ///< what is wrong, and what to do
};

/// Findings as they are made.
struct FindingList {
  std::vector<Finding> findings;

  /// Nothing is added where there are none.
  void add(const char* code, bool grave, const char* of, const std::vector<std::uint64_t>& which,
           const std::string& words);
};

/// "1 lens", "2 lenses".
std::string plural(std::uint64_t count, const char* one, const char* many);

/// Three digits.
std::string shown(double x);

}  // namespace sheaf
