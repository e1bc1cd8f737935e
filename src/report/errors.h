// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Of non-negative values; all 0 for none.
struct ErrorStatistics {
  double mean = 0, median = 0, rms = 0, max = 0;
};
ErrorStatistics statistics_of_errors(std::vector<double> values);

/// How far an estimate is from a reference with the same images and points. Scene units are the
/// reference's.
struct StateErrors {
  bool aligned = false;  ///< by the Sim(3) that brings the camera centres together best
  double scale = 1;      ///< of that Sim(3)
  ErrorStatistics rotation_error_rad;
  ErrorStatistics translation_error;  ///< |t - t_reference|
  ErrorStatistics center_error;
  ErrorStatistics point_error;
};

/// Errors: ErrorCode::usage when the counts differ. Where the camera centres do not determine a
/// rotation well (fewer than three, or almost on a line), the points take their place in the
/// alignment.
Result<StateErrors> compare_states(const Problem& estimate, const Problem& reference, bool align);

}  // namespace sheaf
