// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Photometric problems by every camera solver: the same minimum.
#include <gtest/gtest.h>

#include <string>

#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

PhotometricScene many_images() {
  PhotometricSceneOptions options;
  options.images = 24;
  options.points = 200;
  options.width = 96;
  options.height = 72;
  options.brightness = 0.05;
  options.noise_grey = 0.5;
  options.start_px = 0.05;
  return generate(options).value();
}

PhotometricOptions options_of(CameraSolverKind solver) {
  PhotometricOptions options;
  options.solver = solver;
  options.tolerance = 1e-14;
  options.motion_px = 1e-6;
  options.max_iterations = 100;
  options.rounds = 1;
  options.loss = {};
  return options;
}

double final_cost(const PhotometricProblem& start, const PhotometricOptions& options,
                  const std::string& solver) {
  PhotometricProblem problem = start;
  const PhotometricSummary summary = refine_photometric(problem, options).value();
  EXPECT_EQ(summary.solve.solver, solver);
  return summary.solve.final_cost;
}

/// From a little beside a minimum: costs of pixels have many, and steps that are solved for loosely
/// may lead from afar into another one.
TEST(PhotometricSolvers, ConjugateGradientsEndWhereDenseDoes) {
  PhotometricScene scene = many_images();
  ASSERT_TRUE(refine_photometric(scene.start, options_of(CameraSolverKind::dense)).ok());
  for (std::size_t i = 0; i < scene.start.poses.size(); ++i)
    scene.start.poses[i].translation[i % 3] += 1e-4;
  const double dense = final_cost(scene.start, options_of(CameraSolverKind::dense), "dense");
  for (const auto& [solver, name] :
       {std::pair{CameraSolverKind::sparse, "sparse"},
        std::pair{CameraSolverKind::iterative_explicit, "iterative-explicit"},
        std::pair{CameraSolverKind::iterative_implicit, "iterative-implicit"}}) {
    SCOPED_TRACE(name);
    EXPECT_NEAR(final_cost(scene.start, options_of(solver), name), dense, 1e-9 * dense);
  }
}

}  // namespace
}  // namespace sheaf
