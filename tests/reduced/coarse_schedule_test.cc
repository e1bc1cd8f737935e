// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/coarse_schedule.h"

#include <gtest/gtest.h>

namespace sheaf {
namespace {

using Matrix = CoarseSchedule::Matrix;

/// A schedule whose matrix was summed at this damping, at a state of cost 100, for a solve of ten
/// iterations.
CoarseSchedule summed_at(double lambda) {
  CoarseSchedule schedule;
  schedule.moved(100);
  EXPECT_EQ(schedule.next(lambda), Matrix::summed);
  schedule.solved(10);
  return schedule;
}

TEST(CoarseSchedule, StrongDampingNeedsNone) {
  CoarseSchedule schedule;
  EXPECT_EQ(schedule.next(1e-2), Matrix::unneeded);
  schedule.solved(4);
  EXPECT_EQ(schedule.next(3e-3), Matrix::summed);
  EXPECT_EQ(schedule.next(1e-2), Matrix::unneeded);  // steps were rejected
  EXPECT_EQ(schedule.next(3e-3), Matrix::kept);
}

TEST(CoarseSchedule, KeepsTheMatrixWhileTheCostIsMuchTheSame) {
  CoarseSchedule schedule = summed_at(1e-3);
  EXPECT_EQ(schedule.next(2e-3), Matrix::kept);
  schedule.moved(81);
  EXPECT_EQ(schedule.next(1e-3), Matrix::kept);
  schedule.moved(79);
  EXPECT_EQ(schedule.next(1e-3), Matrix::summed);
  schedule.moved(79);
  EXPECT_EQ(schedule.next(1e-3), Matrix::kept);
}

TEST(CoarseSchedule, AHigherCostIsAnotherLoss) {
  CoarseSchedule schedule = summed_at(1e-3);
  schedule.moved(101);
  EXPECT_EQ(schedule.next(1e-3), Matrix::summed);
}

TEST(CoarseSchedule, SumsAnewForMuchWeakerDamping) {
  CoarseSchedule schedule = summed_at(1e-3);
  EXPECT_EQ(schedule.next(1.1e-5), Matrix::kept);
  EXPECT_EQ(schedule.next(0.9e-5), Matrix::summed);
}

TEST(CoarseSchedule, SumsAnewWhereSolvesTakeLonger) {
  CoarseSchedule schedule = summed_at(1e-3);
  EXPECT_EQ(schedule.next(1e-3), Matrix::kept);
  schedule.solved(17);
  EXPECT_EQ(schedule.next(1e-3), Matrix::kept);
  schedule.solved(18);
  EXPECT_EQ(schedule.next(1e-3), Matrix::summed);
  schedule.solved(18);  // as many with the new one: nothing is gained by another
  EXPECT_EQ(schedule.next(1e-3), Matrix::kept);
}

}  // namespace
}  // namespace sheaf
