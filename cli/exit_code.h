// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/error.h"
#include "sheaf/solve.h"

namespace sheaf {

inline constexpr int kExitInterrupted = 130;

/// Of a solve that ran: 0 for a usable result, 130 when it was cut short, 4 without a usable step
/// or a weight above 0.
inline int exit_code_of(Termination termination) {
  switch (termination) {
    case Termination::stopped:
    case Termination::time_limit:
      return kExitInterrupted;
    case Termination::no_usable_step:
    case Termination::zero_weights:
      return static_cast<int>(ErrorCode::no_usable_step);
    default:
      return 0;
  }
}

}  // namespace sheaf
