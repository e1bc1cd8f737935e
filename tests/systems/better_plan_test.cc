// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "systems/plan.h"

namespace sheaf {
namespace {

/// A street of a thousand images: few blocks for each, so that a sparse factor is cheap.
WorkCounts street() {
  WorkCounts counts;
  counts.images = 1000;
  counts.columns = 9000;
  counts.observations = 2000000;
  counts.batches = 260000;
  counts.pairs = 4000000;
  counts.tiles = 12000;
  counts.sparse_flops = 2e9;
  counts.sparse_doubles = 3000000;
  counts.clusters = 125;
  counts.longest_track = 20;
  return counts;
}

TEST(BetterPlan, IsTheExactSolverWhereConjugateGradientsTakeMany) {
  const auto plan = better_plan(street(), SolverKind::implicit_cg, 200);
  ASSERT_TRUE(plan.has_value());
  EXPECT_EQ(plan->kind, SolverKind::sparse);
  EXPECT_FALSE(plan->reason.empty());
}

TEST(BetterPlan, IsNoneWhereLittleIsToBeGained) {
  WorkCounts counts = street();
  EXPECT_FALSE(better_plan(counts, plan_solver(counts).kind, 9).has_value())
      << "as many as were counted with";
  counts.sparse_flops = 1e14;
  counts.pairs = 2000000000;
  EXPECT_FALSE(better_plan(counts, SolverKind::implicit_cg, 20).has_value());
}

}  // namespace
}  // namespace sheaf
