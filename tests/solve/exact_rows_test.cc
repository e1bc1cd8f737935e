// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

struct Found {
  PhotometricSummary summary;
  PhotometricProblem problem;
};

Found refined(const PhotometricProblem& start, PhotometricOptions options, PatchRows rows) {
  Found out{{}, start};
  options.rows = rows;
  out.summary = refine_photometric(out.problem, options).value();
  return out;
}

TEST(ExactRows, FindTheMinimumThatSharedRowsFind) {
  for (const char* pattern : {"4x4", "9x9"}) {
    PhotometricSceneOptions o;
    o.images = 5, o.points = 300, o.width = 256, o.height = 192, o.noise_grey = 2;
    o.brightness = 0.1;
    const PhotometricProblem start = generate(o).value().start;
    PhotometricOptions options;
    options.loss = Huber{5};
    options.pattern = pattern;
    options.tolerance = 1e-10, options.motion_px = 1e-4;
    options.rounds = 1;
    const Found shared = refined(start, options, PatchRows::shared);
    const Found exact = refined(start, options, PatchRows::exact);
    EXPECT_TRUE(exact.summary.solve.usable());
    EXPECT_EQ(exact.summary.solve.initial_cost, exact.summary.solve.iterations.front().cost);
    EXPECT_NEAR(exact.summary.solve.initial_cost, shared.summary.solve.initial_cost,
                1e-10 * shared.summary.solve.initial_cost);
    // The exact step knows the cost's own gradient; the shared one stops where its own ends.
    EXPECT_LE(exact.summary.solve.final_cost, shared.summary.solve.final_cost * (1 + 1e-7));
    EXPECT_NEAR(exact.summary.solve.final_cost, shared.summary.solve.final_cost,
                1e-3 * shared.summary.solve.final_cost);
    EXPECT_LE(exact.summary.solve.iterations.size(), shared.summary.solve.iterations.size() + 2);
  }
}

// Patches that move as a whole share their derivatives anyway: the same bits.
TEST(ExactRows, ChangeNothingWherePatchesAreTranslated) {
  PhotometricSceneOptions o;
  o.images = 4, o.points = 100, o.width = 160, o.height = 120;
  const PhotometricProblem start = generate(o).value().start;
  PhotometricOptions options;
  options.warp = Warp::translation;
  options.max_iterations = 5;
  EXPECT_EQ(refined(start, options, PatchRows::exact).problem.points,
            refined(start, options, PatchRows::shared).problem.points);
}

}  // namespace
}  // namespace sheaf
