// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "sheaf/solve.h"

namespace sheaf {

/// When a run ends at the latest.
struct RunLimits {
  int max_iterations = 0;
  double tolerance = 0;
  double time_limit_s = std::numeric_limits<double>::infinity();
};

/// How long a run still takes, from the steps that it has made: where the decreases of the cost
/// fall by a steady factor, until two in a row are below the tolerance; else no more than the steps
/// that may be tried and the time limit leave.
class TimeLeft {
 public:
  explicit TimeLeft(const RunLimits& limits) : limits_(limits) {}
  void add(const Iteration& iteration);

  struct Estimate {
    double seconds = 0;
    bool at_most = false;  ///< a bound; nothing says that it takes so long
  };
  /// After the step that was added last; infinite seconds where nothing bounds it.
  Estimate now() const;

 private:
  RunLimits limits_;
  std::vector<double> times_s_;    ///< of the last steps, since the run's beginning
  std::vector<double> decreases_;  ///< relative, of the last accepted steps
  int steps_ = 0, round_ = 0;
};

}  // namespace sheaf
