// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/photometric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "geometry/loss.h"
#include "geometry/rotation.h"
#include "report/errors.h"
#include "rows/photometric.h"
#include "sheaf/sheaf.h"
#include "solve/patch_level.h"
#include "solve/photometric_scenes.h"

namespace sheaf {
namespace {

using test::project;

/// After a Sim(3) by the camera centres: rotations, and where true points are seen from the
/// estimated poses.
struct Errors {
  double rotation_rad = 0, reprojection_px = 0;
  double converged = 0;  ///< share of the patches that end within a tenth of a pixel
};

Problem shell_of(const PhotometricProblem& p) {
  Problem out;
  for (const Pose& pose : p.poses) out.add_image(pose, Camera{});
  out.points = p.points;
  return out;
}

/// Projections are free of gauge: the estimate's own points seen by its own poses.
Errors errors_of(const PhotometricProblem& estimate, const PhotometricProblem& truth) {
  Errors out;
  out.rotation_rad =
      compare_states(shell_of(estimate), shell_of(truth), true).value().rotation_error_rad.mean;
  std::size_t count = 0;
  for (std::size_t i = 0; i < truth.num_points(); ++i)
    for (std::size_t j = 0; j < truth.images.size(); ++j) {
      if (truth.host[i] == j) continue;
      const auto a = project(estimate, j, i), b = project(truth, j, i);
      if (b[0] < 8 || b[1] < 8 || b[0] > truth.images[j].width - 9 ||
          b[1] > truth.images[j].height - 9)
        continue;
      const double off = std::hypot(a[0] - b[0], a[1] - b[1]);
      out.reprojection_px += off;
      out.converged += off < 0.1;
      ++count;
    }
  out.reprojection_px /= static_cast<double>(count);
  out.converged /= static_cast<double>(count);
  return out;
}

PhotometricSceneOptions small_scene() {
  PhotometricSceneOptions o;
  o.images = 5, o.points = 2000, o.width = 256, o.height = 192;
  o.relief = 0.01;
  return o;
}

struct Outcome {
  Errors errors;
  PhotometricSummary summary;
  PhotometricProblem refined, truth;
  double a = 0, b = 0;  ///< largest errors of the brightness
};

Outcome refined(const PhotometricSceneOptions& o, const PhotometricOptions& options) {
  PhotometricScene scene = generate(o).value();
  Outcome out;
  out.summary = refine_photometric(scene.start, options).value();
  out.errors = errors_of(scene.start, scene.truth);
  for (std::size_t i = 0; i < o.images; ++i) {
    const Brightness &is = scene.start.brightness[i], &was = scene.truth.brightness[i];
    out.a = std::max(out.a, std::abs(is.a - was.a));
    out.b = std::max(out.b, std::abs(is.b - was.b));
  }
  out.refined = std::move(scene.start);
  out.truth = std::move(scene.truth);
  return out;
}

PhotometricOptions plain_options() {
  PhotometricOptions options;
  options.affine_brightness = false;
  options.loss = Huber{10};
  return options;
}

// A patch is taken to be as deep everywhere as in its middle. On a surface that is tilted against
// its host (here by six degrees) a patch that is not even about its middle is then off by the
// tilt's parallax over half a pixel, whatever the interpolation: the sixteen pixels of -2 to 1 end
// at 0.008 px, and the five of the cross, which is even, show what interpolation alone is good for.
// The cameras stand on a circle of a tenth of their depth, so that a turn and a move look almost
// the same, and what interpolation does to all patches alike (of waves of 8 px 0.003 px, read
// bilinearly 0.025 px) ends up in both: in images of 320 x 240 rotations end at 5e-5 and 3e-4 rad.
// The same pixels are half the angle in images twice as wide, and more points share the rest.
TEST(PhotometricProof, ExactImagesComeBackToTheTruth) {
  PhotometricOptions options = plain_options();
  options.pattern = "cross";
  PhotometricSceneOptions o;
  o.relief = 0.01, o.points = 3000, o.width = 640, o.height = 480;
  for (double wavelength : {8.0, 12.0}) {
    o.wavelength_px = wavelength;
    const Outcome cubic = refined(o, options);
    EXPECT_TRUE(cubic.summary.solve.usable());
    EXPECT_LT(cubic.errors.reprojection_px, 0.005) << wavelength;
    EXPECT_LT(cubic.errors.rotation_rad, 2e-5) << wavelength;
  }
  options.interpolation = Interpolation::bilinear;
  const Outcome lines = refined(o, options);
  EXPECT_LT(lines.errors.reprojection_px, 0.03);
  EXPECT_LT(lines.errors.rotation_rad, 2e-4);
}

TEST(PhotometricProof, TheCoursesPatchIsBiasedByTiltAlone) {
  const Outcome tilted = refined(small_scene(), plain_options());
  EXPECT_LT(tilted.errors.reprojection_px, 0.012);
  EXPECT_LT(tilted.errors.rotation_rad, 1e-4);
}

/// Twice the robust cost of those of these sights that are in their images in all of the states.
std::vector<double> costs_of(const std::vector<const PhotometricProblem*>& problems,
                             const std::vector<Sight>& sights, const PhotometricOptions& options) {
  const PatchScene scene =
      scene_of_level(*problems[0], options, make_pattern(options.pattern).value(), 0);
  std::vector<PatchState> states;
  for (const PhotometricProblem* problem : problems) states.push_back(state_of(*problem, true));
  std::vector<double> out(problems.size(), 0), residuals;
  for (const Sight& sight : sights) {
    if (!std::all_of(states.begin(), states.end(),
                     [&](const PatchState& state) { return is_seen(scene, state, sight); }))
      continue;
    for (std::size_t k = 0; k < states.size(); ++k) {
      patch_residuals(scene, states[k], sight, residuals);
      for (double r : residuals)
        out[k] += evaluate_loss({options.loss.kind, options.loss.scale_px}, r * r).value;
    }
  }
  return out;
}

// Catches signs and orders: no state may cost less than the one found, the truth included. Both are
// evaluated by plain code, over the patches that counted.
TEST(PhotometricProof, TheTruthCostsNoLess) {
  for (LossKind kind : {LossKind::none, LossKind::huber, LossKind::cauchy}) {
    PhotometricSceneOptions o = small_scene();
    o.noise_grey = 2, o.eight_bit = true;
    PhotometricOptions options = plain_options();
    options.loss = {kind, 5};
    options.tolerance = 1e-9;
    options.rounds = 1;
    const PhotometricProblem start = generate(o).value().start;
    const PatchScene scene = scene_of_level(start, options, make_pattern("4x4").value(), 0);
    std::vector<Sight> counted;
    for (const Sight& sight : all_sights(start, true))
      if (is_seen(scene, state_of(start, true), sight)) counted.push_back(sight);
    const Outcome found = refined(o, options);
    const std::vector<double> costs =
        costs_of({&found.refined, &found.truth, &start}, counted, options);
    EXPECT_GE(costs[1], costs[0]) << to_string(kind);
    EXPECT_LT(costs[1], 1.05 * costs[0]) << "the truth is next to it";
    EXPECT_GT(costs[2], 2 * costs[0]) << to_string(kind);
  }
}

// A run has converged when 99% of its patches have: the others sit in a wave of their own.
TEST(PhotometricProof, OnePixelAwayNeedsNoPyramid) {
  constexpr int kRuns = 100;
  int converged = 0;
  for (int run = 1; run <= kRuns; ++run) {
    PhotometricSceneOptions o = small_scene();
    o.points = 200, o.width = 160, o.height = 120;
    o.seed = static_cast<std::uint64_t>(run);
    converged += refined(o, plain_options()).errors.converged > 0.99;
  }
  EXPECT_GE(converged, 99);
}

TEST(PhotometricProof, SixPixelsAwayNeedThreeLevels) {
  PhotometricSceneOptions o;
  o.relief = 0.01, o.start_px = 6;
  PhotometricOptions options = plain_options();
  for (int levels : {1, 2, 3}) {
    options.levels = levels;
    const double converged = refined(o, options).errors.converged;
    if (levels < 3)
      EXPECT_LT(converged, 0.992) << levels;
    else
      EXPECT_GT(converged, 0.992);
  }
}

// Four levels halve 8 px to one; patches of 8 x 8 are as wide there as the waves that lead astray.
TEST(PhotometricProof, EightPixelsAwayNeedMoreOfBoth) {
  PhotometricSceneOptions o;
  o.relief = 0.01, o.start_px = 8;
  PhotometricOptions options = plain_options();
  options.pattern = "8x8";
  for (int levels : {1, 2, 4}) {
    options.levels = levels;
    const double converged = refined(o, options).errors.converged;
    if (levels < 3)
      EXPECT_LT(converged, 0.985) << levels;
    else
      EXPECT_GT(converged, 0.99);
  }
}

TEST(PhotometricProof, BrightnessIsRecovered) {
  PhotometricSceneOptions o = small_scene();
  o.brightness = 0.2;
  PhotometricOptions options = plain_options();
  const Outcome without = refined(o, options);
  options.affine_brightness = true;
  const Outcome with = refined(o, options);
  EXPECT_LT(with.a, 1e-3);
  EXPECT_LT(with.b, 0.1);
  EXPECT_LT(with.errors.reprojection_px, 0.012);
  EXPECT_GT(without.errors.reprojection_px, 10 * with.errors.reprojection_px);
}

TEST(PhotometricProof, OccluderAndOutliersDoNotSpoilTheRest) {
  PhotometricSceneOptions o = small_scene();
  o.occluder = true, o.outliers = 0.02, o.eight_bit = true, o.noise_grey = 1;
  PhotometricOptions options;
  options.min_zncc = 0.5;
  EXPECT_LT(refined(o, options).errors.rotation_rad, 3e-3);
}

TEST(Photometric, ThreadsDoNotChangeABit) {
  PhotometricSceneOptions o = small_scene();
  o.noise_grey = 2;
  PhotometricOptions options;
  options.max_iterations = 5;
  options.threads = 1;
  const Outcome one = refined(o, options);
  options.threads = 3;
  const Outcome three = refined(o, options);
  EXPECT_EQ(one.summary.solve.final_cost, three.summary.solve.final_cost);
  EXPECT_EQ(one.refined.points, three.refined.points);
}

TEST(Photometric, StoredPatchesAndWorldPointsComeBackToo) {
  PhotometricOptions options = plain_options();
  options.parametrisation = Parametrisation::xyz;
  const Outcome found = refined(small_scene(), options);
  // Patches move as a whole: scale and roll between the images are not modelled.
  EXPECT_LT(found.errors.reprojection_px, 0.2);
  EXPECT_LT(found.summary.final_rms_grey, 0.3 * found.summary.initial_rms_grey);
}

TEST(Photometric, WhatIsHeldStays) {
  PhotometricScene scene = generate(small_scene()).value();
  const PhotometricProblem start = scene.start;
  PhotometricOptions options = plain_options();
  options.max_iterations = 3;
  options.fix_poses = true;
  refine_photometric(scene.start, options).value();
  for (std::size_t i = 0; i < start.poses.size(); ++i) {
    EXPECT_EQ(scene.start.poses[i].rotation, start.poses[i].rotation);
    EXPECT_EQ(scene.start.poses[i].translation, start.poses[i].translation);
  }
  EXPECT_NE(scene.start.points, start.points);
  PhotometricProblem held = start;
  options.fix_poses = false, options.fix_points = true;
  options.parametrisation = Parametrisation::xyz;
  refine_photometric(held, options).value();
  EXPECT_EQ(held.points, start.points);
  EXPECT_NE(held.poses[1].translation, start.poses[1].translation);
}

TEST(Photometric, RefusesWhatContradicts) {
  PhotometricScene scene = generate(small_scene()).value();
  const auto refused = [&](const PhotometricProblem& problem, const PhotometricOptions& options) {
    PhotometricProblem copy = problem;
    const auto result = refine_photometric(copy, options);
    return !result.ok() && result.error().code() == ErrorCode::usage;
  };
  PhotometricOptions options;
  options.parametrisation = Parametrisation::xyz;
  options.levels = 2;
  EXPECT_TRUE(refused(scene.start, options));
  options = {};
  options.levels = 5;
  EXPECT_TRUE(refused(scene.start, options)) << "192 rows halved four times are 12";
  options = {};
  options.pattern = "2x2";
  EXPECT_TRUE(refused(scene.start, options));
  PhotometricProblem no_hosts = scene.start;
  no_hosts.host.clear();
  options = {};
  options.warp = Warp::inverse_depth;
  EXPECT_TRUE(refused(no_hosts, options));
  PhotometricProblem behind = scene.start;
  behind.points[2] -= 100;
  EXPECT_TRUE(refused(behind, {}));
  PhotometricProblem nan = scene.start;
  nan.points[5] = std::nan("");
  EXPECT_TRUE(refused(nan, {}));
}

// Of the exercise that the patch's layout comes from: 7 images, 4118 points.
class PhotometricCourse : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("SHEAF_DATA");
    folder_ = std::filesystem::path(data ? data : "data") / "direct/directba-shenlan-l7";
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " is not there";
    problem_ = read_photometric(folder_, {.camera = Pinhole{277.34, 291.402, 312.234, 239.777}})
                   .value()
                   .problem;
  }
  static PhotometricOptions compatible() {
    PhotometricOptions options;
    options.interpolation = Interpolation::bilinear;
    options.affine_brightness = false;
    options.loss = Huber{1};
    options.loss_per_patch = true;
    options.leaving = Leaving::free;
    options.tolerance = 0;
    options.max_iterations = 35;
    return options;
  }
  std::filesystem::path folder_;
  PhotometricProblem problem_;
};

TEST_F(PhotometricCourse, StartsWhereItIsKnownTo) {
  PhotometricOptions options = compatible();
  options.loss = {};
  options.max_iterations = 0;
  const PhotometricSummary start = refine_photometric(problem_, options).value();
  EXPECT_EQ(start.patches_total, 28826u);
  EXPECT_EQ(start.patches_visible, 24501u);
  EXPECT_NEAR(start.solve.initial_cost, 1.874110e8, 1e-5 * 1.874110e8);
  EXPECT_NEAR(start.initial_rms_grey, 30.92, 0.005);
}

TEST_F(PhotometricCourse, CompatibleSettingsGoBelowTheKnownRun) {
  const PhotometricSummary summary = refine_photometric(problem_, compatible()).value();
  EXPECT_LT(2 * summary.solve.final_cost, 2.909e6);  // where g2o ends
}

TEST_F(PhotometricCourse, BrightnessExplainsMuchOfTheRest) {
  const PhotometricSummary summary = refine_photometric(problem_, {}).value();
  EXPECT_LT(summary.final_rms_grey, 24);
  EXPECT_LT(summary.final_median_grey, 5);
  for (const Brightness& of : problem_.brightness) {
    EXPECT_GT(of.a, 0.6);
    EXPECT_LT(of.a, 1);
  }
}

TEST(Photometric, NothingInSightIsSaid) {
  PhotometricProblem problem = generate(PhotometricSceneOptions{}).value().start;
  for (std::size_t i = 0; i < problem.poses.size(); ++i)
    problem.poses[i].translation[0] += 1e5 * static_cast<double>(i);
  const PhotometricProblem before = problem;
  const PhotometricSummary summary = refine_photometric(problem).value();
  EXPECT_EQ(summary.solve.termination, Termination::no_usable_step);
  EXPECT_NE(summary.solve.words.find("is seen in any image"), std::string::npos)
      << summary.solve.words;
  EXPECT_EQ(problem.points, before.points);
}

}  // namespace
}  // namespace sheaf
