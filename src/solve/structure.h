// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/problem.h"

namespace sheaf {

/// What of a problem its arrangement is a function of, beside the options: which image sees which
/// point through which camera, models and what their files leave out, rigs, whether there are
/// sigmas, and all terms. Not the state, the measurements or the sigmas themselves.
class Structure {
 public:
  /// Of a valid problem. Throws std::bad_alloc.
  explicit Structure(const Problem& problem);
  /// Whether a problem has it; allocates nothing.
  bool is_of(const Problem& problem) const;

 private:
  std::string bytes_;
};

}  // namespace sheaf
