// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Lenses of any model, own or shared, alone or mixed: steps against the textbook's, which shares
// nothing with the kernels but the scalar statement of each model.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "geometry/lenses.h"
#include "io/models.h"
#include "sheaf/sheaf.h"
#include "solve/lens_problems.h"
#include "solve/scenes.h"
#include "solve/textbook.h"
#include "starts/bearing.h"

namespace sheaf {
namespace {

using test::all_models;
using test::disturbed;
using test::mixtures;
using test::nothing_held;
using test::ordinary;
using test::thinned;
using test::unshared;

TEST(LensModels, StepsAreTheTextbooksWithSharedLenses) {
  for (CameraModel model : all_models()) {
    SCOPED_TRACE(to_string(model));
    const Problem problem = thinned(disturbed({ordinary(model)}, 5, 23, 1), 2);
    expect_textbook_step(problem, {}, 1e-3);
    expect_textbook_step(problem, nothing_held(problem), 1e-2);
  }
}

TEST(LensModels, StepsAreTheTextbooksWithLensesOfTheirOwn) {
  for (CameraModel model : all_models()) {
    SCOPED_TRACE(to_string(model));
    const Problem problem = unshared(thinned(disturbed({ordinary(model)}, 5, 23, 3), 4));
    expect_textbook_step(problem, {}, 1e-3);
    expect_textbook_step(problem, nothing_held(problem), 1e-2);
  }
}

TEST(LensModels, StepsAreTheTextbooksWhereModelsAreMixed) {
  for (const Problem& problem : mixtures()) {
    expect_textbook_step(problem, {}, 1e-3);
    expect_textbook_step(problem, nothing_held(problem), 1e-2);
  }
}

TEST(LensModels, StepsAreTheTextbooksBySparseCholesky) {
  for (const Problem& problem : mixtures())
    expect_textbook_step(problem, {}, 1e-3, {}, PointParametrisation::xyz,
                         CameraSolverKind::sparse);
}

TEST(LensModels, StepsAreTheTextbooksWithPartsHeld) {
  for (const Problem& problem : mixtures()) {
    Fixed some = nothing_held(problem);
    for (std::size_t c = 0; c < some.parameters.size(); ++c)
      some.parameters[c] = static_cast<ParameterSet>(0x2d5 >> c % 3);
    some.camera_ids = {1};
    some.pose_ids = {0, 3};
    Fixed poses;
    poses.poses = true;
    Fixed intrinsics;
    intrinsics.intrinsics = true;
    for (const Fixed& fixed : {some, poses, intrinsics, points_held()})
      expect_textbook_step(problem, fixed, 1e-2);
  }
}

TEST(LensModels, StepsAreTheTextbooksWithALoss) {
  for (const Problem& problem : mixtures()) {
    expect_textbook_step(problem, {}, 1e-2, Cauchy{0.5});
    expect_textbook_step(problem, points_held(), 1e-2, Huber{0.5});
  }
}

TEST(LensModels, StepsAreTheTextbooksWhereOneImageSeesAPointTwice) {
  Problem problem = mixtures()[2];
  for (std::size_t i = 0; i < 60; i += 3)
    problem.add_observation(problem.observation_image[i], problem.observation_point[i],
                            problem.observation_xy[2 * i] + 3, problem.observation_xy[2 * i + 1]);
  expect_textbook_step(problem, {}, 1e-2);
}

/// What a start and options end with.
struct Solved {
  Problem problem;
  Summary summary;

  Solved(const Problem& start, const SolveOptions& options) : problem(start) {
    summary = solve(problem, options);
  }
};

/// Enough of everything that all parameters are well determined.
Problem determined(bool shared) {
  const Problem problem =
      thinned(disturbed({ordinary(CameraModel::opencv), ordinary(CameraModel::radial_fisheye)}, 10,
                        300, 13),
              14);
  return shared ? problem : unshared(problem);
}

TEST(LensModels, EveryInstructionSetAndThreadCountEndsAlike) {
  for (bool shared : {true, false}) {
    const Problem start = determined(shared);
    SolveOptions options;
    options.threads = 1;
    options.loss = Huber{1};
    options.tolerance = 1e-13;
    const Solved best(start, options);
    EXPECT_LT(best.summary.final_cost, 0.5 * best.summary.initial_cost);
    options.threads = 3;
    const Solved threads(start, options);
    EXPECT_EQ(state_hash(best.problem), state_hash(threads.problem));
    for (Simd simd : {Simd::scalar, Simd::sse4, Simd::avx2, Simd::neon}) {
      options.simd = simd;
      Problem problem = start;
      const Result<Summary> other = try_solve(problem, options);
      if (!other.ok()) continue;  // the machine does not have it
      EXPECT_NEAR(other.value().final_cost, best.summary.final_cost,
                  1e-9 * best.summary.final_cost);
    }
  }
}

TEST(LensModels, SolversEndAlike) {
  for (bool shared : {true, false}) {
    const Problem start = determined(shared);
    SolveOptions options;
    options.tolerance = 1e-13;
    options.max_iterations = 200;
    options.solver = CameraSolverKind::dense;
    const Solved dense(start, options);
    EXPECT_EQ(dense.summary.solver, "dense");
    EXPECT_NEAR(dense.summary.final_cost, evaluate(dense.problem).cost,
                1e-10 * dense.summary.final_cost);
    EXPECT_LT(scaled_gradient(dense.problem), 1e-3);
    for (CameraSolverKind kind : {CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
                                  CameraSolverKind::iterative_implicit}) {
      options.solver = kind;
      const Solved other(start, options);
      EXPECT_NEAR(other.summary.final_cost, dense.summary.final_cost,
                  1e-8 * dense.summary.final_cost)
          << other.summary.solver;
    }
  }
}

TEST(LensModels, WhatIsHeldStaysBitForBit) {
  for (const Problem& start : mixtures()) {
    SolveOptions options;
    options.fixed.pose_ids = {1};
    options.fixed.camera_ids = {0};
    const Solved run(start, options);
    EXPECT_EQ(run.problem.poses[1].rotation, start.poses[1].rotation);
    EXPECT_EQ(run.problem.poses[1].translation, start.poses[1].translation);
    EXPECT_EQ(run.problem.cameras[0].parameters, start.cameras[0].parameters);
    for (std::size_t c = 0; c < start.cameras.size(); ++c) {
      const CameraModel model = start.cameras[c].model;
      const unsigned held = principal_point(model) | image_size(model);
      for (std::size_t k = 0; k < kMaxCameraParameters; ++k) {
        const double before = start.cameras[c].parameters[k],
                     after = run.problem.cameras[c].parameters[k];
        const bool free =
            k < parameter_count(start.cameras[c].model) && c != 0 && (held >> k & 1) == 0;
        EXPECT_EQ(before == after, !free) << "camera " << c << ", " << k;
      }
    }
  }
}

/// Cameras amid their points, which are seen in all directions that the lens sees.
Problem surrounded(CameraModel model, double most_degrees, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Problem problem;
  problem.cameras = {ordinary(model)};
  for (int i = 0; i < 300; ++i) {
    double X[3], length = 0;
    for (double& x : X) x = normal(random), length += x * x;
    for (double& x : X) x *= (4 + 0.5 * normal(random)) / std::sqrt(length);
    problem.add_point(X[0], X[1], X[2]);
  }
  for (int j = 0; j < 12; ++j) {
    Pose pose;
    pose.rotation = quaternion_from_angle_axis<double>(
        {0.6 * normal(random), 0.6 * normal(random), 0.6 * normal(random)});
    pose.translation = {0.5 * normal(random), 0.5 * normal(random), 0.5 * normal(random)};
    const std::uint32_t image = problem.add_image(pose, 0u);
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    for (std::uint32_t i = 0; i < problem.num_points(); ++i) {
      const double* X = &problem.points[3 * i];
      Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
      for (std::size_t k = 0; k < 3; ++k) P[k] += pose.translation[k];
      const double degrees = std::atan2(std::hypot(P[0], P[1]), P[2]) * 180 / 3.14159265358979;
      if (degrees > most_degrees || !sees(problem.cameras[0], P)) continue;
      const auto pixel = project(problem.cameras[0], P).pixel;
      problem.add_observation(image, i, pixel[0], pixel[1]);
    }
  }
  return problem;
}

TEST(LensModels, WideLensesConvergeFromADegreeAndAHundredth) {
  for (CameraModel model :
       {CameraModel::opencv_fisheye, CameraModel::simple_radial_fisheye,
        CameraModel::radial_fisheye, CameraModel::eucm, CameraModel::fov, CameraModel::fisheye,
        CameraModel::double_sphere, CameraModel::ucm, CameraModel::equirectangular}) {
    SCOPED_TRACE(to_string(model));
    const bool panorama = model == CameraModel::equirectangular;
    const Problem truth = surrounded(model, panorama ? 180 : 100, 11);
    Problem start = truth;
    std::mt19937 random(12);
    std::normal_distribution<double> normal;
    for (Pose& pose : start.poses) {
      const double degree = 3.14159265358979 / 180;
      const auto moved = left_perturbed(
          RigidMotion<double>{pose.rotation, pose.translation}, {0, 0, 0},
          {degree * normal(random), degree * normal(random), degree * normal(random)});
      pose = {moved.rotation, moved.translation};
      for (double& t : pose.translation) t *= 1 + 0.01 * normal(random);
    }
    for (double& x : start.points) x *= 1 + 0.01 * normal(random);
    for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
      if (((principal_point(model) | image_size(model)) >> k & 1) == 0)
        start.cameras[0].parameters[k] *= 1 + 0.01 * normal(random);
    const Solved run(start, {.max_iterations = 100, .tolerance = 1e-12});
    EXPECT_LT(run.summary.final_rms_px, 1e-6);
    for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
      EXPECT_NEAR(run.problem.cameras[0].parameters[k], truth.cameras[0].parameters[k],
                  1e-5 * (1 + std::abs(truth.cameras[0].parameters[k])));
  }
}

/// Panoramas amid their points, beside fisheyes, with noise that carries pixels over the borders.
Problem joined(bool mixed) {
  Problem problem = surrounded(CameraModel::equirectangular, 180, 21);
  std::mt19937 random(22);
  std::normal_distribution<double> normal;
  for (double& x : problem.observation_xy) x += 3 * normal(random);
  for (double& x : problem.points) x += 0.01 * normal(random);
  if (!mixed) return problem;
  // The odd images see what lies before them through another lens.
  Problem out = problem;
  out.cameras.push_back(ordinary(CameraModel::fisheye));
  out.observation_image.clear(), out.observation_point.clear(), out.observation_xy.clear();
  for (std::uint32_t j = 1; j < out.num_images(); j += 2) out.image_camera[j] = 1;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t j = problem.observation_image[i], point = problem.observation_point[i];
    double xy[2] = {problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]};
    if (j % 2 == 1) {
      const auto ray = bearing(problem.cameras[0], xy);
      if (!ray || (*ray)[2] < -0.5) continue;
      const auto pixel = project(out.cameras[1], *ray).pixel;
      xy[0] = pixel[0], xy[1] = pixel[1];
    }
    out.add_observation(j, point, xy[0], xy[1]);
  }
  return out;
}

TEST(LensModels, PanoramasAreJoinedAtTheirBorders) {
  const Problem whole = joined(false);
  std::size_t crossing = 0;
  for (std::size_t i = 0; i < whole.num_observations(); ++i)
    crossing += whole.observation_xy[2 * i] < 0 || whole.observation_xy[2 * i] > 640;
  EXPECT_GT(crossing, 5u);
  for (const bool mixed : {false, true}) {
    SCOPED_TRACE(mixed);
    const Problem start = joined(mixed);
    EXPECT_TRUE(evaluate(start).behind.empty());
    expect_textbook_step(thinned(start, 23), {}, 1e-3);
    SolveOptions options;
    options.tolerance = 1e-13;
    const Solved best(start, options);
    // A pixel that were not joined would cost 640^2 / 2.
    EXPECT_LT(best.summary.initial_cost, 50.0 * static_cast<double>(start.num_observations()));
    EXPECT_NEAR(best.summary.final_cost, evaluate(best.problem).cost,
                1e-10 * best.summary.final_cost);
    // A fisheye's pixel is a third of a panorama's.
    EXPECT_LT(best.summary.final_rms_px, mixed ? 9 : 4.5);
    EXPECT_EQ(best.problem.cameras[0].parameters, start.cameras[0].parameters);
    for (Simd simd : {Simd::scalar, Simd::sse4, Simd::avx2, Simd::neon}) {
      options.simd = simd;
      Problem problem = start;
      const Result<Summary> other = try_solve(problem, options);
      if (!other.ok()) continue;  // the machine does not have it
      EXPECT_NEAR(other.value().final_cost, best.summary.final_cost,
                  1e-9 * best.summary.final_cost);
    }
  }
}

TEST(LensModels, HeldParametersOfOtherCamerasAreRefusedInWords) {
  Problem problem = mixtures()[2];
  SolveOptions options;
  options.fixed.parameters = {0};
  EXPECT_EQ(try_solve(problem, options).error().code(), ErrorCode::usage);
}

double minimum(const Problem& start, const SolveOptions& wanted) {
  Problem problem = start;
  SolveOptions options = wanted;
  options.tolerance = 1e-13;
  options.max_iterations = 200;
  return try_solve(problem, options).value().final_cost;
}

/// What BAL cameras have: other coordinates of points, the dogleg, mixed precision, by every
/// solver.
TEST(LensModels, EveryWayEndsAtTheSameMinimum) {
  const Problem shared = disturbed({ordinary(CameraModel::opencv)}, 12, 300, 7);
  for (const Problem& problem :
       {shared, unshared(shared), disturbed({ordinary(CameraModel::opencv_fisheye)}, 12, 300, 8),
        disturbed({ordinary(CameraModel::opencv), ordinary(CameraModel::opencv_fisheye),
                   ordinary(CameraModel::simple_radial)},
                  12, 300, 11)}) {
    const double plain = minimum(problem, {});
    for (CameraSolverKind solver :
         {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
          CameraSolverKind::iterative_implicit}) {
      SolveOptions options;
      options.solver = solver;
      const auto expect_minimum = [&](const char* what) {
        SCOPED_TRACE(testing::Message() << what << ", solver " << static_cast<int>(solver));
        EXPECT_NEAR(minimum(problem, options), plain, 1e-9 * plain);
      };
      options.precision = Precision::mixed;
      expect_minimum("mixed");
      options.trust_region = TrustRegion::dogleg;
      expect_minimum("dogleg, mixed");
      options.precision = Precision::full;
      expect_minimum("dogleg");
      options.trust_region = TrustRegion::lm;
      for (PointParametrisation points :
           {PointParametrisation::homogeneous, PointParametrisation::inverse_depth}) {
        options.points = points;
        expect_minimum("chart");
      }
    }
  }
}

}  // namespace
}  // namespace sheaf
