// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/choose_points.h"

#include <gtest/gtest.h>

#include "sheaf/io.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"

namespace sheaf {
namespace {

/// A car's images: far points are seen under small angles.
Problem street() {
  FamilyOptions options;
  options.family = SceneFamily::street;
  options.images = 40;
  options.points = 3000;
  options.observations = 13000;
  return generate(options).value().start;
}

TEST(ChoosePoints, StreetsStepByInverseDepthAndLakesidesDoNot) {
  const PointChoice far = choose_points(street(), {}, {});
  EXPECT_EQ(far.points, PointParametrisation::inverse_depth);
  EXPECT_FALSE(far.crosses);
  EXPECT_NE(far.reason.find("parallax"), std::string::npos);
  EXPECT_EQ(choose_points(small_scene().start, {}, {}).points, PointParametrisation::xyz);
}

TEST(ChoosePoints, WhatIsAskedForIsTaken) {
  const Problem problem = street();
  SolveOptions options;
  for (PointParametrisation points : {PointParametrisation::xyz, PointParametrisation::homogeneous,
                                      PointParametrisation::inverse_depth}) {
    options.points = points;
    EXPECT_EQ(choose_points(problem, {}, options).points, points);
    EXPECT_TRUE(choose_points(problem, {}, options).crosses);
  }
  options = {};
  options.fixed.points = true;
  EXPECT_EQ(choose_points(problem, {}, options).points, PointParametrisation::xyz);
  options = {};
  options.loss = Huber{1};
  EXPECT_EQ(choose_points(problem, {}, options).points, PointParametrisation::xyz);
  options = {};
  options.trust_region = TrustRegion::dogleg;
  EXPECT_EQ(choose_points(problem, {}, options).points, PointParametrisation::xyz);
}

TEST(ChoosePoints, ParallaxIsInPixelsOfTheImagesThatSeeIt) {
  Problem problem;
  const Camera camera{CameraModel::simple_pinhole, {1000, 320, 240}};
  problem.add_image({{1, 0, 0, 0}, {0, 0, 0}}, camera);
  problem.add_image({{1, 0, 0, 0}, {-1, 0, 0}}, camera);  // centre at (1, 0, 0)
  for (double z : {20.0, 40.0, 100.0, 400.0}) {
    const std::uint32_t point = problem.add_point(0, 0, z);
    problem.add_observation(0, point, 320, 240);
    problem.add_observation(1, point, 320 - 1000 / z, 240);
  }
  problem.add_observation(0, problem.add_point(0, 0, 1e9), 320, 240);  // one ray has no parallax
  ParallaxScratch scratch;
  EXPECT_EQ(share_of_small_parallax(problem, {}, 5, scratch), 0.25);
  EXPECT_EQ(share_of_small_parallax(problem, {}, 20, scratch), 0.5);
  EXPECT_EQ(share_of_small_parallax(problem, {}, 60, scratch), 1);
  EXPECT_EQ(share_of_small_parallax(problem, {0, 0, 0, 0, 0, 1, 0, 0, 0}, 20, scratch), 1.0 / 3);
}

TEST(ChoosePoints, StreetsEndWhereXyzEndsInFewerSteps) {
  Problem chosen = street(), xyz = street();
  SolveOptions options;
  options.max_iterations = 100;
  const Summary s = solve(chosen, options);
  EXPECT_EQ(s.points, "inverse-depth");
  options.points = PointParametrisation::xyz;
  const Summary plain = solve(xyz, options);
  EXPECT_EQ(plain.points, "xyz");
  EXPECT_LE(s.final_cost, plain.final_cost * (1 + 1e-6));
  EXPECT_GT(s.final_cost, plain.final_cost * (1 - 1e-3)) << "no minimum beyond infinity";
  EXPECT_LT(s.iterations.size(), plain.iterations.size());
}

TEST(ChoosePoints, ARotatingCamerasPointsMayPassThroughInfinity) {
  Problem problem = read_file(case_file("panorama-f0.5.txt")).value().problem;
  const PointChoice choice = choose_points(problem, {}, {});
  EXPECT_EQ(choice.points, PointParametrisation::inverse_depth);
  EXPECT_TRUE(choice.crosses);
  EXPECT_LE(solve(problem).final_cost, 271.8);
}

}  // namespace
}  // namespace sheaf
