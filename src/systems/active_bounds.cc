// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/active_bounds.h"

#include <algorithm>
#include <utility>

namespace sheaf {
namespace {

// Half of the digits: the step of a held column and what the others pull at it are both known to
// 1e-8 of their size.
constexpr double kHold = 1e8;
constexpr double kLeastSquare = 1e-6;  // of columns that no row sees

}  // namespace

void ActiveBounds::begin(std::vector<StepBound> bounds, const Buffer<double>& rhs,
                         const Buffer<double>& squares) {
  bounds_ = std::move(bounds);
  squares_ = &squares;
  held_.clear();
  for (const StepBound& bound : bounds_) {
    const double push = rhs[static_cast<std::size_t>(bound.column)];
    if ((bound.upper <= 0 && push > 0) || (bound.lower >= 0 && push < 0)) hold(bound.column, 0);
  }
}

void ActiveBounds::hold(std::int32_t column, double step) {
  const double square = (*squares_)[static_cast<std::size_t>(column)];
  held_.push_back({column, step, kHold * std::max(square, kLeastSquare)});
}

bool ActiveBounds::holds(std::int32_t column) const {
  return std::any_of(held_.begin(), held_.end(),
                     [column](const Held& h) { return h.column == column; });
}

bool ActiveBounds::steps() const {
  return std::any_of(held_.begin(), held_.end(), [](const Held& h) { return h.step != 0; });
}

bool ActiveBounds::prescribe(Buffer<double>& rhs, Buffer<double>& damping) {
  std::vector<std::int32_t> columns;
  for (Held& h : held_) {
    columns.push_back(h.column);
    const auto c = static_cast<std::size_t>(h.column);
    h.rhs = std::exchange(rhs[c], h.hold * h.step);
    h.damping = std::exchange(damping[c], h.hold);
  }
  std::sort(columns.begin(), columns.end());
  return std::exchange(before_, columns) != columns;
}

void ActiveBounds::put_back(Buffer<double>& rhs, Buffer<double>& damping, Buffer<double>& step) {
  for (Held& h : held_) {
    const auto c = static_cast<std::size_t>(h.column);
    rhs[c] = h.rhs;
    damping[c] = h.damping;
    h.pull = h.hold * (h.step - step[c]);
    step[c] = h.step;
  }
}

bool ActiveBounds::add_crossing(const Buffer<double>& step) {
  bool any = false;
  for (const StepBound& bound : bounds_) {
    const double x = step[static_cast<std::size_t>(bound.column)];
    if (holds(bound.column) || (bound.lower <= x && x <= bound.upper)) continue;
    hold(bound.column, std::clamp(x, bound.lower, bound.upper));
    any = true;
  }
  return any;
}

double ActiveBounds::correction() const {
  double sum = 0;
  for (const Held& h : held_) sum += h.step * (h.rhs - h.pull - h.damping * h.step);
  return sum;
}

}  // namespace sheaf
