// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>

#include "live_line.h"
#include "report/time_left.h"
#include "sheaf/solve.h"

namespace sheaf {

/// Reports iterations on stderr: in a terminal one line that moves (step, cost, rms, memory, time
/// and what is left of it), self-contained lines elsewhere.
class Progress {
 public:
  /// residuals: observations that a step's rms is of; 0: of no pixels. With a loss none is shown.
  explicit Progress(bool quiet, const RunLimits& limits = {}, std::size_t residuals = 0);
  /// Set-up begins, of which a terminal is told where it is long.
  void begin();
  /// The solver chosen and the memory forecast, before anything is allocated.
  void report_plan(const Summary& summary);
  void report(const Iteration& iteration);
  /// The run is over; before anything else is printed.
  void end();

 private:
  enum class Style { none, moving, lines };
  void move(const Iteration& iteration);
  void report_line(const Iteration& iteration);
  /// Lines that stay.
  void clear();

  bool quiet_;
  Style style_;
  RunLimits limits_;
  TimeLeft left_;
  std::size_t residuals_;
  int round_ = 0;
  std::optional<Activity> setup_;
};

}  // namespace sheaf
