// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/time_left.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sheaf {
namespace {

/// A step every half second.
Iteration step(int index, double before, double after) {
  Iteration out;
  out.index = index;
  out.start_cost = before;
  out.cost = out.trial_cost = after;
  out.accepted = index == 0 || after < before;
  out.time_s = 0.5 * index;
  return out;
}

TEST(TimeLeft, IsAnEstimateWhereDecreasesFallSteadily) {
  TimeLeft left({50, 1e-8});
  double cost = 1000;
  left.add(step(0, cost, cost));
  EXPECT_FALSE(std::isfinite(left.now().seconds));
  for (int k = 1; k <= 4; ++k) {
    const double next = cost * (1 - std::pow(0.1, k));
    left.add(step(k, cost, next));
    cost = next;
  }
  // The last decrease is 1e-4 and the next ones a tenth each: four to the tolerance and one more.
  EXPECT_FALSE(left.now().at_most);
  EXPECT_NEAR(left.now().seconds, 5 * 0.5, 0.51);
  left.add(step(5, cost, cost * (1 - 1e-9)));
  EXPECT_NEAR(left.now().seconds, 0.5, 1e-9);
}

TEST(TimeLeft, IsABoundWhereARunCreeps) {
  TimeLeft left({50, 1e-8}), limited({50, 1e-8, 3});
  double cost = 1000;
  for (int k = 0; k <= 6; ++k) {
    const double next = k == 0 ? cost : 0.99 * cost;
    left.add(step(k, cost, next));
    limited.add(step(k, cost, next));
    cost = next;
  }
  EXPECT_TRUE(left.now().at_most);
  EXPECT_NEAR(left.now().seconds, 44 * 0.5, 1e-9);
  EXPECT_NEAR(limited.now().seconds, 0, 1e-9);
}

TEST(TimeLeft, RejectedStepsTakeTheirTimeAndTellNothing) {
  TimeLeft left({10, 1e-8});
  left.add(step(0, 100, 100));
  for (int k = 1; k <= 5; ++k) left.add(step(k, 100, 120));
  EXPECT_TRUE(left.now().at_most);
  EXPECT_NEAR(left.now().seconds, 5 * 0.5, 1e-9);
}

}  // namespace
}  // namespace sheaf
