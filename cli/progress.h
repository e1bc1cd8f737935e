// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/solve.h"

namespace sheaf {

/// Reports iterations on stderr: a table in a terminal, self-contained lines elsewhere.
class Progress {
 public:
  explicit Progress(bool quiet);
  /// The solver chosen and the memory forecast, before anything is allocated.
  void report_plan(const Summary& summary);
  void report(const Iteration& iteration);

 private:
  enum class Style { none, table, lines };
  Style style_;
  int round_ = 0;
};

}  // namespace sheaf
