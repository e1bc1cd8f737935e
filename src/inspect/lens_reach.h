// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// How far pixels reach from a lens's principal point: the farthest one of each of eight sectors.
struct LensReach {
  static constexpr std::size_t kSectors = 8;
  std::array<std::array<double, 2>, kSectors> offsets{};  ///< px from the principal point; 0: none

  /// Of an offset: eighths of a turn, from the negative x axis on and y downward first.
  static std::size_t sector_of(const std::array<double, 2>& offset);
  void add(const std::array<double, 2>& offset);
  /// The farthest of all, px.
  double farthest() const;
};

/// Of the four corners of a lens's images; all 0 where their size is not known.
LensReach reach_of_corners(const Camera& camera);

/// What a problem's measurements say of its lenses.
struct MeasuredReaches {
  /// Observations that no image can hold, ascending. Where the size of the images is known they lie
  /// outside by more than that size; else they are farther from the principal point than 100 times
  /// the median of their lens, or of all lenses where theirs has fewer than ten observations.
  std::vector<std::uint64_t> absurd;
  /// One for each lens, of its observations within 10 times that median: wrong matches may lie
  /// anywhere, and should not tell how far a lens reaches.
  std::vector<LensReach> reaches;
};
MeasuredReaches measured_reaches(const Problem& problem);

}  // namespace sheaf
