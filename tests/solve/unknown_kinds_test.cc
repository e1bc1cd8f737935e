// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "options/photometric_options.h"
#include "sheaf/sheaf.h"

// Enumerations that a caller has made from integers which are none of their values: errors in every
// public function that takes them, and nothing is touched.
namespace sheaf {
namespace {

Problem scene() {
  LensSceneOptions options;
  options.scene = {.images = 5, .points = 60};
  options.lenses = 1;
  return generate(options).value().start;
}

template <class Enum>
Enum unknown() {
  return static_cast<Enum>(77);
}

void expect_refused(const Result<void>& result, const std::string& words) {
  ASSERT_FALSE(result.ok()) << words;
  EXPECT_EQ(result.error().code(), ErrorCode::usage);
  EXPECT_NE(std::string(result.error().what()).find(words), std::string::npos)
      << result.error().what();
}
template <class T>
void expect_refused(const Result<T>& result, const std::string& words) {
  expect_refused(result.ok() ? Result<void>() : Result<void>(result.error()), words);
}

TEST(UnknownKinds, OfCamerasAreRefusedEverywhere) {
  Problem problem = scene();
  problem.cameras[0].model = unknown<CameraModel>();
  const std::string words = "camera 0: found 77, expected the number of a model below 22";
  const std::vector<double> points = problem.points;
  expect_refused(validate(problem), words);
  expect_refused(try_solve(problem), words);
  expect_refused(covariance(problem), words);
  expect_refused(marginalise(problem, {0}, {}, {}), words);
  expect_refused(perturb(problem, {}), words);
  expect_refused(write(problem, "never-written", {}), words);
  EXPECT_THROW(evaluate(problem), Error);
  EXPECT_EQ(problem.points, points);
  Camera camera;
  camera.model = unknown<CameraModel>();
  expect_refused(projection_uncertainty(camera, {}, {}), "none that there is");
}

TEST(UnknownKinds, OfASolveAreRefused) {
  const auto refused = [](const auto& change, const std::string& words) {
    Problem problem = scene();
    const std::vector<double> points = problem.points;
    SolveOptions options;
    change(options);
    expect_refused(try_solve(problem, options), words);
    EXPECT_EQ(problem.points, points);
  };
  refused([](SolveOptions& o) { o.solver = unknown<CameraSolverKind>(); }, "solver: ");
  refused([](SolveOptions& o) { o.precision = unknown<Precision>(); }, "precision: ");
  refused([](SolveOptions& o) { o.points = unknown<PointParametrisation>(); }, "points: ");
  refused([](SolveOptions& o) { o.trust_region = unknown<TrustRegion>(); }, "trust_region: ");
  refused([](SolveOptions& o) { o.cheirality = unknown<Cheirality>(); }, "cheirality: ");
  refused([](SolveOptions& o) { o.simd = unknown<Simd>(); }, "simd: ");
  refused([](SolveOptions& o) { o.loss.kind = unknown<LossKind>(); }, "loss: ");
  refused([](SolveOptions& o) { o.loss = {unknown<LossKind>(), 2, false}; }, "loss: ");
}

TEST(UnknownKinds, OfCovariancesAndMarginalsAreRefused) {
  const Problem problem = scene();
  const auto refused = [&](const auto& change) {
    CovarianceOptions options;
    change(options);
    expect_refused(covariance(problem, options), "none that there is");
  };
  refused([](CovarianceOptions& o) { o.gauge = unknown<Gauge>(); });
  refused([](CovarianceOptions& o) { o.solver = unknown<CovarianceSolver>(); });
  refused([](CovarianceOptions& o) { o.loss = {unknown<LossKind>(), 1, false}; });
  MarginaliseOptions options;
  options.loss = {unknown<LossKind>(), 1, false};
  expect_refused(marginalise(problem, {0}, {}, options), "none that there is");
}

TEST(UnknownKinds, OfTermsAreRefused) {
  Problem problem = scene();
  const TermLoss unknown_loss{unknown<LossKind>(), 1};
  problem.terms.distances.push_back({0, 1, 1.0, 0.1, unknown_loss});
  expect_refused(validate(problem), "the loss is none that there is");
  problem.terms = {};
  problem.terms.parameters.push_back({0, 0, problem.cameras[0].parameters[0], 2, unknown_loss});
  expect_refused(validate(problem), "the loss is none that there is");
  problem.terms = {};
  GaussianPrior prior;
  prior.blocks.push_back({unknown<GaussianPrior::Block::Kind>(), 0, {0, 0, 0}});
  prior.square_root = {1, 0, 0};
  problem.terms.gaussians.push_back(prior);
  expect_refused(validate(problem), "no kind that there is");
}

TEST(UnknownKinds, OfScenesAndNoiseAreRefused) {
  LensSceneOptions lens;
  lens.model = unknown<CameraModel>();
  expect_refused(generate(lens), "none that there is");
  RigSceneOptions rig;
  rig.kind = unknown<RigKind>();
  expect_refused(generate(rig), "none that there is");
  rig = {};
  rig.model = unknown<CameraModel>();
  expect_refused(generate(rig), "none that there is");
  FamilyOptions family = scene_like("ladybug-49").value();
  family.family = unknown<SceneFamily>();
  expect_refused(generate(family), "none that there is");
  Problem problem = scene();
  NoiseOptions noise;
  noise.protocol = unknown<NoiseProtocol>();
  expect_refused(perturb(problem, noise), "none that there is");
}

TEST(UnknownKinds, OfPhotometricRefinementsAreRefused) {
  const auto refused = [](const auto& change) {
    PhotometricOptions options;
    change(options);
    const Result<void> checked = check_fields(options);
    ASSERT_FALSE(checked.ok());
    EXPECT_EQ(checked.error().code(), ErrorCode::usage);
  };
  refused([](PhotometricOptions& o) { o.interpolation = unknown<Interpolation>(); });
  refused([](PhotometricOptions& o) { o.warp = unknown<Warp>(); });
  refused([](PhotometricOptions& o) { o.solver = unknown<CameraSolverKind>(); });
  refused([](PhotometricOptions& o) { o.loss.kind = unknown<LossKind>(); });
  refused([](PhotometricOptions& o) { o.parametrisation = unknown<Parametrisation>(); });
  refused([](PhotometricOptions& o) { o.leaving = unknown<Leaving>(); });
  refused([](PhotometricOptions& o) { o.rows = unknown<PatchRows>(); });
}

}  // namespace
}  // namespace sheaf
