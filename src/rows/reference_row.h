// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>

namespace sheaf {

/// What an observation of any kind hands to elimination, in plain scalar code: its residual and its
/// derivatives by the nine columns of the camera block and by the point.
struct PointRow {
  std::array<double, 2> r{};
  std::array<std::array<double, 9>, 2> camera{};
  std::array<std::array<double, 3>, 2> point{};

  double square() const { return r[0] * r[0] + r[1] * r[1]; }
  void scale(double by) {
    for (std::size_t e = 0; e < 2; ++e) {
      r[e] *= by;
      for (double& x : camera[e]) x *= by;
      for (double& x : point[e]) x *= by;
    }
  }
};

}  // namespace sheaf
