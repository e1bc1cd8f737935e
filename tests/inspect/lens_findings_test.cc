// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_findings.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "geometry/camera_model.h"
#include "geometry/lenses.h"
#include "inspect/check.h"
#include "io/models.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

using Numbers = std::vector<std::uint64_t>;

/// Four images through two lenses of a model, measured with a little noise.
Problem healthy(CameraModel model) {
  Camera camera = test::ordinary(model);
  if (model != CameraModel::bal) camera.width_px = 640, camera.height_px = 480;
  Problem problem = test::seen_by({camera, camera}, 4, 40, 3);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.3);
  for (double& x : problem.observation_xy) x += noise(random);
  return problem;
}

/// The code of the finding that names lens 1 alone; "" where no finding names a lens.
std::string code_of_lens_1(const Problem& problem) {
  std::string code;
  for (const Finding& finding : check(problem)) {
    if (finding.of != "lenses") continue;
    EXPECT_TRUE(code.empty()) << "a lens has one finding, not " << code << " and " << finding.code;
    EXPECT_EQ(finding.first, (Numbers{1})) << finding.words;
    EXPECT_EQ(finding.count, 1u);
    code = finding.code;
  }
  return code;
}

/// Division models have a coefficient and end instead.
bool folds(CameraModel model) {
  return roles_of(model).k1 >= 0 && model != CameraModel::simple_division &&
         model != CameraModel::division;
}

class LensFindings : public testing::TestWithParam<std::size_t> {
 protected:
  CameraModel model() const { return static_cast<CameraModel>(GetParam()); }
};

TEST_P(LensFindings, NothingIsWrongWithAHealthyScene) {
  for (const Finding& finding : check(healthy(model()))) ADD_FAILURE() << finding.words;
}

/// Scenes as wide as the generator makes them: 65 degrees, or 200.
TEST_P(LensFindings, NothingIsWrongWithLensesOfTheGenerator) {
  LensSceneOptions options;
  options.model = model();
  options.scene.images = 24;
  options.scene.points = 500;
  options.scene.mean_track = 6;
  const Scene scene = generate(options).value();
  for (const Problem* problem : {&scene.truth, &scene.start})
    for (const Finding& finding : check(*problem))
      EXPECT_FALSE(finding.of == "lenses" || finding.code == "absurd-measurements" ||
                   finding.code == "camera-plane" || finding.code == "camera-centre")
          << finding.words;
}

TEST_P(LensFindings, FindsAbsurdFocals) {
  if (roles_of(model()).fx < 0) GTEST_SKIP() << to_string(model()) << " has no focal length";
  for (const double f : {0.0, -500.0, 1e-3, 1e9, 1e300}) {
    Problem problem = healthy(model());
    problem.cameras[1].parameters[0] = f;
    EXPECT_EQ(code_of_lens_1(problem), "absurd-focal") << f;
  }
}

TEST_P(LensFindings, FindsAbsurdDistortion) {
  const ParameterRoles roles = roles_of(model());
  if (roles.fx < 0) GTEST_SKIP() << to_string(model()) << " has no distortion";
  for (std::size_t i = 0; i < parameter_count(model()); ++i) {
    const int k = static_cast<int>(i);
    if (k == roles.fx || k == roles.fy || k == roles.cx || k == roles.cy) continue;
    for (const double value : {1e9, -1e9, 1e300}) {
      Problem problem = healthy(model());
      problem.cameras[1].parameters[i] = value;
      EXPECT_EQ(code_of_lens_1(problem), "absurd-distortion")
          << parameter_names(model())[i] << " " << value;
    }
  }
}

TEST_P(LensFindings, FindsFoldsWithinTheObservations) {
  const ParameterRoles roles = roles_of(model());
  if (!folds(model())) GTEST_SKIP() << to_string(model()) << " has no coefficient that folds it";
  Problem problem = healthy(model());
  Camera& camera = problem.cameras[1];
  const double edge = measured_reaches(problem).reaches[1].farthest() / camera.parameters[0];
  camera.parameters[static_cast<std::size_t>(roles.k1)] = -0.5 / (edge * edge);
  EXPECT_EQ(code_of_lens_1(problem), "folding-lens");
}

/// The corners of images are farther out than what is observed here, and a note is enough.
TEST_P(LensFindings, NotesFoldsTowardsTheCorners) {
  const ParameterRoles roles = roles_of(model());
  if (!folds(model()) || model() == CameraModel::bal)
    GTEST_SKIP() << to_string(model()) << " has no coefficient that folds it, or no size";
  Problem problem = healthy(model());
  Camera& camera = problem.cameras[1];
  camera.width_px = 2 * 640, camera.height_px = 2 * 480;
  camera.parameters[static_cast<std::size_t>(roles.cx)] *= 2;
  camera.parameters[static_cast<std::size_t>(roles.cy)] *= 2;
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (problem.image_camera[problem.observation_image[i]] == 1) {
      problem.observation_xy[2 * i] += 320;
      problem.observation_xy[2 * i + 1] += 240;
    }
  const double edge = measured_reaches(problem).reaches[1].farthest() / camera.parameters[0];
  camera.parameters[static_cast<std::size_t>(roles.k1)] = -0.1 / (edge * edge);
  EXPECT_EQ(code_of_lens_1(problem), "folding-corners");
  for (const Finding& finding : check(problem)) {
    EXPECT_TRUE(finding.of != "lenses" || !finding.grave);
  }
}

INSTANTIATE_TEST_SUITE_P(OfEveryModel, LensFindings, testing::Range<std::size_t>(0, kCameraModels),
                         [](const auto& info) {
                           return std::string(to_string(static_cast<CameraModel>(info.param)));
                         });

TEST(LensFindingsOfProblems, ZeroFocalLength) {
  Problem problem = test::seen_by({test::ordinary(CameraModel::simple_radial)}, 4, 20, 1);
  problem.cameras[0].parameters[0] = 0;
  const std::vector<Finding> found = check(problem);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].code, "absurd-focal");
}

}  // namespace
}  // namespace sheaf
