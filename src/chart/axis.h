// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

namespace sheaf {

/// Round values between the ends: multiples of 1, 2, 2.5 or 5 times a power of ten, about `count`
/// of them; the lower end alone where there is nothing between.
std::vector<double> round_ticks(double low, double high, int count = 5);

/// Powers of ten between the ends, each k-th where there would be more than `most`. Ends above 0.
std::vector<double> decade_ticks(double low, double high, int most = 5);

/// 1, 2 and 5 times powers of ten between the ends, thinned to `most`. Ends above 0.
std::vector<double> log_ticks(double low, double high, int most = 5);

/// The largest of 1, 2 and 5 times a power of ten that is at most x, which is above 0.
double round_below(double x);

/// How values lie along a side of a chart.
struct Axis {
  double low = 0, high = 1;  ///< of the values, low < high; logarithmic: above 0
  double from = 0, to = 1;   ///< of the drawing
  bool logarithmic = false;

  /// Values beyond the ends lie beyond them; 0 and less on a logarithmic axis far below.
  double operator()(double value) const;
};

}  // namespace sheaf
