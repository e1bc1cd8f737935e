// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "geometry/loss.h"
#include "platform/parallel.h"
#include "sheaf/options.h"
#include "sheaf/solve.h"

namespace sheaf {

/// A reason for stopping that says more than the loop can, which sees sums alone.
struct Ending {
  Termination termination;
  std::string words;
};

/// What there was to say of a run that is over, if anything: nothing was free to move, the start
/// was not finite (and which observation made it so), every weight is zero, or one observation's
/// cost is so large that its rounding hides what all others could gain. problem: at its end, but
/// for no_usable_step, where it is as it was. skip: 1 for each observation that was left out, or
/// empty.
std::optional<Ending> ending_of(const Problem& problem, const std::vector<std::uint8_t>& skip,
                                const SolveOptions& options, const Summary& summary,
                                Threads& threads);

/// The observation whose cost is so large that its rounding hides a thousandth of all others', if
/// there is one.
std::optional<std::uint64_t> drowning_observation(const Problem& problem,
                                                  const std::vector<std::uint8_t>& skip,
                                                  const ScaledLoss& loss, Threads& threads);

}  // namespace sheaf
