// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// While it lives, the problem's cameras are BAL ones, which is what the kernels know; afterwards
/// they are of their own models again, with what was refined. Exact: only measurements are rounded
/// meanwhile (by the principal point), and those come back as they were.
class BalView {
 public:
  /// Whether BAL's formula describes all cameras and what is to be refined of them.
  static bool serves(const Problem& problem, const Fixed& fixed);
  /// The problem must be one that it serves. Sets Fixed::parameters to what is held of the BAL
  /// cameras: what the models do not have too.
  BalView(Problem& problem, Fixed& fixed);
  ~BalView();
  BalView(const BalView&) = delete;
  BalView& operator=(const BalView&) = delete;

 private:
  Problem& problem_;
  bool turned_ = false;
  std::vector<Camera> cameras_;  ///< as they were
  std::vector<double> xy_;
};

}  // namespace sheaf
