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
  template <class Visit>
  void visit_columns(const Visit& visit) {
    for (std::size_t k = 0; k < 9; ++k) visit(camera[0][k], camera[1][k]);
    for (std::size_t k = 0; k < 3; ++k) visit(point[0][k], point[1][k]);
  }
};

}  // namespace sheaf
