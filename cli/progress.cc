// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "terminal.h"

namespace sheaf {

Progress::Progress(bool quiet)
    : style_(quiet                   ? Style::none
             : isatty(STDERR_FILENO) ? Style::table
                                     : Style::lines) {}

void Progress::report_plan(const Summary& summary) {
  if (style_ == Style::none) return;
  print_err("solver {}: {}; memory about {:.0f} MB\n", summary.solver, summary.solver_reason,
            1e-6 * static_cast<double>(summary.forecast_bytes));
}

namespace {

/// A number, or a dash where there is none.
std::string shown(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

}  // namespace

void Progress::report(const Iteration& it) {
  const std::string change = shown(it.trial_cost - it.start_cost, "{:.3e}");
  const std::string gain = std::isfinite(it.trial_cost) ? shown(it.gain_ratio, "{:.3f}") : "-";
  if (style_ != Style::none && it.round != round_)
    print_err("round {}: the loss has another scale, the cost is {:.9e}\n", it.round + 1,
              it.start_cost);
  round_ = it.round;
  if (style_ != Style::none && it.passes > 0) {
    print_err("{}: steps went wrong; {} passes of resection and intersection led to cost {:.9e}\n",
              it.index, it.passes, it.cost);
    return;
  }
  if (style_ == Style::table) {
    if (it.index == 0)
      print_err("{:>5} {:>16} {:>11} {:>8} {:>9} {:>9} {:>9}\n", "iter", "cost", "change", "gain",
                "damping", "gradient", "time (s)");
    if (it.index == 0)
      print_err("{:>5} {:>16.9e} {:>11} {:>8} {:>9} {:>9.2e} {:>9.3f}\n", 0, it.cost, "", "", "",
                it.gradient_max, it.time_s);
    else
      print_err("{:>5} {:>16.9e} {:>11} {:>8} {:>9.2e} {:>9.2e} {:>9.3f}{}\n", it.index, it.cost,
                change, gain, it.damping, it.gradient_max, it.time_s,
                it.accepted ? "" : "  rejected");
    std::fflush(stderr);
  } else if (style_ == Style::lines) {
    if (it.index == 0)
      print_err("start: cost {}\n", shown(it.cost, "{:.9e}"));
    else
      print_err(
          "iteration {}: cost {:.9e}, change {}{}, gain {}, damping {:.2e}, "
          "gradient {:.2e}, {:.3f} s\n",
          it.index, it.cost, change, it.accepted ? "" : " (rejected)", gain, it.damping,
          it.gradient_max, it.time_s);
  }
}

}  // namespace sheaf
