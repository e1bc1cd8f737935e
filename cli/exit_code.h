// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/covariance.h"
#include "sheaf/error.h"
#include "sheaf/solve.h"

namespace sheaf {

inline constexpr int kExitTimeLimit = 7;
inline constexpr int kExitInterrupted = 130;

/// Of a solve that ran: 0 for a usable result, 7 at its time limit, 130 when it was interrupted, 4
/// without a usable step or a weight above 0.
inline int exit_code_of(Termination termination) {
  switch (termination) {
    case Termination::time_limit:
      return kExitTimeLimit;
    case Termination::stopped:
      return kExitInterrupted;
    case Termination::no_usable_step:
    case Termination::zero_weights:
      return static_cast<int>(ErrorCode::no_usable_step);
    default:
      return 0;
  }
}

inline int exit_code_of(CovarianceEnding ending) {
  switch (ending) {
    case CovarianceEnding::time_limit:
      return kExitTimeLimit;
    case CovarianceEnding::stopped:
      return kExitInterrupted;
    case CovarianceEnding::whole:
      return 0;
  }
  return 0;
}

}  // namespace sheaf
