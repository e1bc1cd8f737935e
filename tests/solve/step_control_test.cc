// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/step_control.h"

#include <gtest/gtest.h>

namespace sheaf {
namespace {

/// The damping after good steps, each with as many linear iterations.
double after(std::initializer_list<int> iterations, double gain) {
  StepControl control(TrustRegion::lm, 1);
  for (int i : iterations) control.accepted(gain, Trial{}, i);
  return control.damping();
}

TEST(StepControl, GoodStepsDivideTheDamping) {
  EXPECT_DOUBLE_EQ(after({0}, 1.05), 1.0 / 3);
  EXPECT_DOUBLE_EQ(after({0, 0}, 1.05), 0.1 / 3);
}

TEST(StepControl, ExactModelsDivideItByMore) {
  EXPECT_DOUBLE_EQ(after({0, 0}, 1), 0.01 / 3);
  EXPECT_DOUBLE_EQ(after({0, 0, 0}, 1), 1e-4);  // not below
  EXPECT_DOUBLE_EQ(after({0, 0, 0, 0}, 1), 1e-5);
}

TEST(StepControl, WhereConjugateGradientsTakeLongItFallsMoreSlowly) {
  EXPECT_DOUBLE_EQ(after({6, 15}, 1.05), 0.1 / 3);
  EXPECT_DOUBLE_EQ(after({6, 16}, 1.05), 0.2 / 3);
  EXPECT_DOUBLE_EQ(after({6, 16, 40}, 1), 0.2 * 0.2 / 3);
}

TEST(StepControl, PoorStepsKeepItAndRejectedOnesRaiseIt) {
  EXPECT_GT(after({0, 0}, 0.5), 0.3);
  StepControl control(TrustRegion::lm, 1);
  control.rejected(Trial{});
  EXPECT_DOUBLE_EQ(control.damping(), 2);
  control.rejected(Trial{});
  EXPECT_DOUBLE_EQ(control.damping(), 8);
}

}  // namespace
}  // namespace sheaf
