// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// One step of the solver against one step by the textbook: the whole Jacobian as a dense matrix,
// the damped normal equations of cameras and points together, no elimination.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "sheaf/solve.h"
#include "solve/scenes.h"
#include "solve/textbook.h"

namespace sheaf {
namespace {

const std::vector<double> kDampings = {1e-4, 1e-2, 1, 100};

TEST(Step, IsTheTextbooks) {
  const Problem problem = first_points(small_scene().start, 40);
  for (double damping : kDampings) expect_textbook_step(problem, {}, damping);
}

TEST(Step, IsTheTextbooksWithPartsHeld) {
  const Problem problem = first_points(small_scene().start, 40);
  Fixed distortion_held, singles;
  distortion_held.k1 = distortion_held.k2 = true;
  singles.pose_ids = {1, 4};
  singles.camera_ids = {2};
  Fixed poses_held;
  poses_held.poses = true;
  for (const Fixed& fixed : {points_held(), distortion_held, singles, poses_held})
    for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
}

TEST(Step, IsTheTextbooksWithALoss) {
  // Half a pixel: at the start most residuals lie beyond it.
  const Problem problem = first_points(small_scene().start, 40);
  for (const Loss& loss : {Loss(Huber{0.5}), Loss(SoftL1{0.5}), Loss(Cauchy{0.5}), Loss(Tukey{30}),
                           Loss(GemanMcClure{0.5})})
    for (const Fixed& fixed : {Fixed(), points_held()})
      for (double damping : kDampings) {
        SCOPED_TRACE(to_string(loss.kind));
        expect_textbook_step(problem, fixed, damping, loss);
      }
}

TEST(Step, IsTheTextbooksInCharts) {
  Problem problem = first_points(small_scene().start, 40);
  const Problem near = problem;
  for (int times : {1, 30})
    for (PointParametrisation points :
         {PointParametrisation::homogeneous, PointParametrisation::inverse_depth}) {
      SCOPED_TRACE(times);
      for (std::size_t i = 0; i < problem.points.size(); ++i)
        problem.points[i] = near.points[i] * (i / 3 % 2 == 0 ? times : 1);
      Fixed singles;
      singles.pose_ids = {1, 4};
      for (double damping : kDampings) {
        expect_textbook_step(problem, {}, damping, {}, points);
        expect_textbook_step(problem, singles, damping, Cauchy{0.5}, points);
        expect_textbook_step(problem, points_held(), damping, {}, points);
      }
    }
}

TEST(Step, IsTheTextbooksWithSharedLenses) {
  for (std::uint32_t together : {2u, 12u})
    for (bool keep_unused : {false, true}) {
      const Problem problem = first_points(shared_lens_scene(together, keep_unused).start, 40);
      for (const Fixed& fixed : {Fixed(), points_held()})
        for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
    }
}

TEST(Step, IsTheTextbooksWhereOneImageSeesAPointTwice) {
  Problem problem = first_points(small_scene().start, 40);
  for (std::size_t i = 0; i < 60; i += 3)
    for (std::size_t times = 0; times <= i % 2; ++times)
      problem.add_observation(problem.observation_image[i], problem.observation_point[i],
                              problem.observation_xy[2 * i] + 3, problem.observation_xy[2 * i + 1]);
  for (const Fixed& fixed : {Fixed(), points_held()})
    for (double damping : kDampings) expect_textbook_step(problem, fixed, damping);
}

}  // namespace
}  // namespace sheaf
