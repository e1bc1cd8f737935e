// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "geometry/loss.h"
#include "platform/parallel.h"
#include "sheaf/solve.h"
#include "starts/sights.h"

namespace sheaf {

/// What recover() may do.
struct RecoveryRequest {
  const Problem& problem;                 ///< its observations; its state is not looked at
  const std::vector<std::uint8_t>& skip;  ///< 1 for each observation to leave out, or empty
  const Fixed& fixed;
  ScaledLoss loss{};
  int most_passes = 0;
  std::function<bool()> cancelled;  ///< asked now and then
};

/// A state that is better by kWorth at least than the one reached, or none.
struct Recovered {
  static constexpr double kWorth = 0.05;
  bool found = false;
  Estimate state{};
  Recovery record{};
};

/// Tries to get out of where steps went wrong, by resection and intersection in turn: every image
/// by itself with the points held, every point by itself with the cameras held. Such passes know
/// nothing of what couples images, so they converge slowly; but none of them can throw one image
/// across the scene because another one is wrong. They set out from the start and from the state
/// that was reached, from each with the images first and with the points first; the cheapest goes
/// on while it gains.
Recovered recover(const RecoveryRequest& request, const Estimate& start, const Estimate& reached,
                  Threads& threads);

}  // namespace sheaf
