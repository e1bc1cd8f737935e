// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "rows/photometric.h"

namespace sheaf {

/// Grey levels that patches are off by, read bilinearly whatever the refinement reads them with, so
/// that settings can be compared: always over the same patches, those seen at the start.
class PatchStatistics {
 public:
  struct Grey {
    double rms = 0, median = 0;
    double inliers = 0;  ///< share of the pixels that are off by no more than kInlier
  };
  static constexpr double kInlier = 10;  ///< grey levels
  /// The scene has to outlive it; `seen` are the patches to measure.
  PatchStatistics(const PatchScene& scene, const std::vector<Sight>& seen);

  void measure_before(const PatchState& state);
  /// A patch that left counts with its residuals of before, or by the mean of all where that is
  /// more.
  void measure_after(const PatchState& state);

  const Grey& before() const { return before_; }
  const Grey& after() const { return after_; }
  std::uint64_t left() const { return left_; }  ///< patches outside after

 private:
  PatchScene scene_;
  std::vector<Sight> seen_;
  std::vector<double> first_;  ///< residuals of before, patch by patch
  Grey before_, after_;
  std::uint64_t left_ = 0;
};

}  // namespace sheaf
