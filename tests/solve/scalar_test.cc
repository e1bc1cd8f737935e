// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Whole runs by plain scalar code, the twins of the kernels from end to end: the minimum that the
// vector code finds.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "eliminate/kernel_table.h"
#include "sheaf/sheaf.h"
#include "solve/loss_rounds.h"
#include "solve/patch_anchor.h"
#include "solve/patch_level.h"
#include "systems/photometric_system.h"

namespace sheaf {
namespace {

constexpr double kSame = 1e-9;

/// Vector code: AVX2 where the machine has it.
const Kernels& vector_kernels() {
  for (const Kernels* kernels : available_kernels())
    if (std::string(kernels->name) == "avx2") return *kernels;
  return *available_kernels().front();
}
const Kernels& scalar_kernels() { return *available_kernels().back(); }

Problem lens_scene(CameraModel model, std::uint64_t lenses) {
  LensSceneOptions options;
  options.model = model;
  options.lenses = lenses;
  options.scene = {.images = 10, .points = 400, .mean_track = 5, .seed = 7};
  return generate(options).value().start;
}

SolveOptions to_the_end() {
  SolveOptions options;
  options.tolerance = 1e-14;
  options.max_iterations = 200;
  options.threads = 2;
  return options;
}

double final_cost(Problem problem, SolveOptions options, Simd simd) {
  options.simd = simd;
  const Summary summary = solve(problem, options);
  EXPECT_LT(summary.final_cost, summary.initial_cost);
  EXPECT_NEAR(summary.final_plain_cost, evaluate(problem).cost, 1e-10 * summary.final_plain_cost)
      << "the problem that is handed back costs what the summary says";
  return summary.final_cost;
}

void expect_same_end(const Problem& start, const SolveOptions& options) {
  const Simd simd = std::string(vector_kernels().name) == "avx2" ? Simd::avx2 : Simd::best;
  const double expected = final_cost(start, options, simd);
  EXPECT_NEAR(final_cost(start, options, Simd::scalar), expected, kSame * expected);
}

TEST(Scalar, LensProblemsEndWhereVectorCodeDoes) {
  if (std::string(scalar_kernels().name) != "scalar") GTEST_SKIP() << "compiled for vectors alone";
  for (const auto& [model, lenses] :
       {std::pair{CameraModel::opencv, 0}, std::pair{CameraModel::opencv, 1},
        std::pair{CameraModel::opencv, 3}, std::pair{CameraModel::opencv_fisheye, 0},
        std::pair{CameraModel::opencv_fisheye, 1}, std::pair{CameraModel::full_opencv, 1}}) {
    SCOPED_TRACE(std::string(to_string(model)) + ", " + std::to_string(lenses));
    expect_same_end(lens_scene(model, static_cast<std::uint64_t>(lenses)), to_the_end());
  }
}

TEST(Scalar, EverySolverOfLensesEndsWhereVectorCodeDoes) {
  if (std::string(scalar_kernels().name) != "scalar") GTEST_SKIP() << "compiled for vectors alone";
  for (int lenses : {0, 1}) {
    const Problem start = lens_scene(CameraModel::opencv, static_cast<std::uint64_t>(lenses));
    for (CameraSolverKind solver :
         {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
          CameraSolverKind::iterative_implicit}) {
      SolveOptions options = to_the_end();
      options.solver = solver;
      expect_same_end(start, options);
    }
    SolveOptions robust = to_the_end();
    robust.loss = Cauchy{1};
    expect_same_end(start, robust);
    SolveOptions held = to_the_end();
    held.fixed.points = true;
    expect_same_end(start, held);
  }
}

/// A photometric problem a little beside a minimum, of which the costs of pixels have many, and
/// what its home is made of.
struct PatchProblem {
  PhotometricOptions options;
  PhotometricProblem problem;
  PatchScene scene;
  PatchState state;
  std::vector<Sight> sights;

  PatchProblem(bool on_rays, bool anchored) {
    PhotometricSceneOptions o;
    o.images = 4, o.points = 80, o.width = 120, o.height = 96, o.start_px = 0.2;
    o.noise_grey = 1, o.brightness = 0.05, o.measured_px = anchored ? 0.1 : -1;
    problem = generate(o).value().start;
    options.parametrisation = on_rays ? Parametrisation::inverse_depth : Parametrisation::xyz;
    if (anchored) options.anchor_px = 0.1;
    EXPECT_TRUE(refine_photometric(problem, options).ok());
    for (std::size_t i = 0; i < problem.poses.size(); ++i)
      problem.poses[i].translation[i % 3] += 1e-4;
    scene = scene_of_level(problem, options, make_pattern("4x4").value(), 0);
    state = state_of(problem, on_rays);
    for (const Sight& sight : all_sights(problem, on_rays))
      if (is_seen(scene, state, sight)) sights.push_back(sight);
  }

  double final_cost(const Kernels& kernels, const PhotometricRules& rules, bool anchored) const {
    Threads threads(2);
    Anchor anchor;
    if (anchored)
      anchor =
          anchor_of_level(measurements_of(problem, options), scene, state, options, 0, /*grey=*/2);
    PhotometricSystem system(scene, state, sights, rules, kernels, threads, std::move(anchor));
    SolveOptions loop = to_the_end();
    loop.loss = Huber{5};
    loop.initial_damping = 1e-4;
    Summary summary;
    minimize_in_rounds(system, loop, Stopwatch(), summary);
    EXPECT_LT(summary.final_cost, summary.initial_cost);
    return summary.final_cost;
  }
};

TEST(Scalar, PatchesEndWhereVectorCodeDoes) {
  if (std::string(scalar_kernels().name) != "scalar") GTEST_SKIP() << "compiled for vectors alone";
  for (bool on_rays : {false, true})
    for (bool anchored : {false, true}) {
      const PatchProblem patches(on_rays, anchored);
      for (bool brightness : {true, false})
        for (bool exact : {false, true}) {
          if (exact && !patches.scene.warped) continue;
          SCOPED_TRACE(std::string(on_rays ? "rays" : "world points") +
                       (anchored ? ", anchored" : "") + (brightness ? ", brightness" : "") +
                       (exact ? ", exact rows" : ""));
          PhotometricRules rules;
          rules.brightness = brightness;
          rules.first_brightness_held = on_rays;
          rules.exact_rows = exact;
          const double expected = patches.final_cost(vector_kernels(), rules, anchored);
          EXPECT_NEAR(patches.final_cost(scalar_kernels(), rules, anchored), expected,
                      kSame * expected);
        }
    }
}

}  // namespace
}  // namespace sheaf
