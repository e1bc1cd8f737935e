// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "progress.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "platform/memory.h"
#include "terminal.h"

namespace sheaf {
namespace {

/// A number, or a dash where there is none.
std::string shown(double value, const char* format) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

/// "about 3 s left", "at most 40 s left", or nothing.
std::string left_text(const TimeLeft::Estimate& left) {
  if (!std::isfinite(left.seconds)) return "";
  const bool minutes = left.seconds >= 90;
  return fmt::format(", {} {:.0f} {} left", left.at_most ? "at most" : "about",
                     std::ceil(left.seconds / (minutes ? 60 : 1)), minutes ? "min" : "s");
}

}  // namespace

Progress::Progress(bool quiet, const RunLimits& limits, std::size_t residuals)
    : quiet_(quiet),
      style_(quiet            ? Style::none
             : stderr_moves() ? Style::moving
                              : Style::lines),
      limits_(limits),
      left_(limits),
      residuals_(residuals) {}

void Progress::begin() { setup_.emplace(quiet_, "set-up"); }

void Progress::end() { clear(); }

void Progress::clear() {
  setup_.reset();
  if (style_ == Style::moving) show_live_line("");
}

void Progress::report_plan(const Summary& summary) {
  if (style_ == Style::none) return;
  clear();
  print_err("solver {}: {}; memory about {:.0f} MB\n", summary.solver, summary.solver_reason,
            1e-6 * static_cast<double>(summary.forecast_bytes));
  begin();
}

void Progress::report(const Iteration& it) {
  if (style_ == Style::none) return;
  setup_.reset();
  left_.add(it);
  if (it.round != round_) {
    clear();
    print_err("round {}: the loss has another scale, the cost is {:.9e}\n", it.round + 1,
              it.start_cost);
  }
  round_ = it.round;
  if (it.passes > 0) {
    clear();
    print_err("{}: steps went wrong; {} passes of resection and intersection led to cost {:.9e}\n",
              it.index, it.passes, it.cost);
  } else if (style_ == Style::moving) {
    move(it);
  } else {
    report_line(it);
  }
}

void Progress::move(const Iteration& it) {
  std::string line = fmt::format("step {}", it.index);
  if (limits_.max_iterations > 0) line += fmt::format("/{}", limits_.max_iterations);
  line += fmt::format("  cost {}", shown(it.cost, "{:.6e}"));
  if (residuals_ > 0 && it.scale_px == 0)
    line += fmt::format("  rms {:.4g} px", std::sqrt(2 * it.cost / double(residuals_)));
  if (it.index > 0 && !it.accepted) line += "  (rejected)";
  line += fmt::format("  {}  {:.1f} s{}", megabytes(resident_bytes()), it.time_s,
                      left_text(left_.now()));
  show_live_line(line);
}

void Progress::report_line(const Iteration& it) {
  if (it.index == 0) return print_err("start: cost {}\n", shown(it.cost, "{:.9e}"));
  const std::string change = shown(it.trial_cost - it.start_cost, "{:.3e}");
  const std::string gain = std::isfinite(it.trial_cost) ? shown(it.gain_ratio, "{:.3f}") : "-";
  print_err(
      "iteration {}: cost {:.9e}, change {}{}, gain {}, damping {:.2e}, "
      "gradient {:.2e}, {:.3f} s\n",
      it.index, it.cost, change, it.accepted ? "" : " (rejected)", gain, it.damping,
      it.gradient_max, it.time_s);
}

}  // namespace sheaf
