// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/axis.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

constexpr double kSlack = 1e-9;

std::vector<double> thinned(std::vector<double> ticks, int most) {
  while (static_cast<int>(ticks.size()) > most) {
    std::vector<double> kept;
    for (std::size_t i = 0; i < ticks.size(); i += 2) kept.push_back(ticks[i]);
    ticks = std::move(kept);
  }
  return ticks;
}

}  // namespace

std::vector<double> round_ticks(double low, double high, int count) {
  const double step = (high - low) / count;
  if (!(step > 0) || !std::isfinite(step)) return {low};
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  double chosen = 10 * power;
  for (const double m : {5.0, 2.5, 2.0, 1.0})
    if (m * power >= 0.999 * step) chosen = m * power;
  std::vector<double> ticks;
  const double first = std::ceil(low / chosen - kSlack), last = std::floor(high / chosen + kSlack);
  for (double i = first; i <= last; ++i) ticks.push_back(i == 0 ? 0 : i * chosen);
  if (ticks.empty()) ticks.push_back(low);
  return ticks;
}

std::vector<double> decade_ticks(double low, double high, int most) {
  const int first = static_cast<int>(std::ceil(std::log10(low) - kSlack));
  const int last = static_cast<int>(std::floor(std::log10(high) + kSlack));
  const int step = std::max(1, (last - first + most) / most);
  std::vector<double> ticks;
  for (int e = first; e <= last; e += step) ticks.push_back(std::pow(10.0, e));
  return ticks;
}

std::vector<double> log_ticks(double low, double high, int most) {
  std::vector<double> ticks;
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::floor(std::log10(high) + kSlack));
  if (last - first > most) return decade_ticks(low, high, most);
  for (int e = first; e <= last; ++e)
    for (const double m : {1.0, 2.0, 5.0}) {
      const double tick = m * std::pow(10.0, e);
      if (tick >= low * (1 - kSlack) && tick <= high * (1 + kSlack)) ticks.push_back(tick);
    }
  return thinned(std::move(ticks), most);
}

double round_below(double x) {
  const double power = std::pow(10.0, std::floor(std::log10(x) + kSlack));
  double best = power;
  for (const double m : {2.0, 5.0})
    if (m * power <= x * (1 + kSlack)) best = m * power;
  return best;
}

double Axis::operator()(double value) const {
  double t;
  if (logarithmic)
    t = (std::log(std::max(value, low * 1e-3)) - std::log(low)) / (std::log(high) - std::log(low));
  else
    t = (value - low) / (high - low);
  return from + (to - from) * t;
}

}  // namespace sheaf
