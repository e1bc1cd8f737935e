// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// While it lives, the problem's cameras are BAL ones, which is what the kernels know; afterwards
/// they are of their own models again, with what was refined. Exact: only measurements are rounded
/// meanwhile (by the principal point), and those come back as they were.
class BalView {
 public:
  /// Adds to `fixed` what the models do not have. Errors: usage, naming the first camera that is
  /// beyond BAL's formula; the problem is then as it was.
  static Result<void> check(const Problem& problem);
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
