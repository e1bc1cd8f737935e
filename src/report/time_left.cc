// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/time_left.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

/// Steps that tell how long one takes and how fast decreases fall.
constexpr std::size_t kRecent = 4;
/// Decreases that fall by less than this a step tell nothing of the end.
constexpr double kSteady = 0.9;

void push(std::vector<double>& last, double value) {
  last.push_back(value);
  if (last.size() > kRecent) last.erase(last.begin());
}

}  // namespace

void TimeLeft::add(const Iteration& it) {
  push(times_s_, it.time_s);
  steps_ = it.index;
  if (it.index == 0) return;
  // A round of the loss, or a recovery, begins anew.
  if (it.passes > 0 || it.round != round_) decreases_.clear();
  round_ = it.round;
  if (it.accepted && it.start_cost > 0)
    push(decreases_, std::max(0.0, (it.start_cost - it.cost) / it.start_cost));
}

TimeLeft::Estimate TimeLeft::now() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (times_s_.size() < 2) return {kInfinity, true};
  const double step =
      (times_s_.back() - times_s_.front()) / static_cast<double>(times_s_.size() - 1);
  const Estimate bound{std::max(0.0, std::min(step * (limits_.max_iterations - steps_),
                                              limits_.time_limit_s - times_s_.back())),
                       true};
  if (decreases_.size() < 3 || !(limits_.tolerance > 0)) return bound;
  const double last = decreases_.back(), first = decreases_.front();
  if (last <= limits_.tolerance) return {std::min(step, bound.seconds), false};
  const double factor = std::pow(last / first, 1 / static_cast<double>(decreases_.size() - 1));
  if (!(factor < kSteady) || !(factor > 0)) return bound;
  const double steps = std::ceil(std::log(limits_.tolerance / last) / std::log(factor)) + 1;
  if (steps * step >= bound.seconds) return bound;
  return {steps * step, false};
}

}  // namespace sheaf
