// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/solve.h"
#include "solve/lens_problems.h"
#include "solve/scenes.h"

namespace sheaf::test {
namespace {

/// Scenes of every model, broken at random in some of many ways, solved in some way drawn at
/// random too. $SHEAF_SWEEP says how many (2000 take about a minute).
int scenes() {
  const char* const asked = std::getenv("SHEAF_SWEEP");
  return asked != nullptr ? std::atoi(asked) : 200;
}

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  std::size_t below(std::size_t n) { return random_() % n; }
  bool one_in(std::size_t n) { return below(n) == 0; }
  double normal() { return normal_(random_); }
  double power(int least, int most) {
    return std::pow(10.0,
                    least + static_cast<double>(below(static_cast<std::size_t>(most - least + 1))));
  }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

void turn(Pose& pose, const Vector3<double>& by) {
  pose.rotation = normalized(multiply(quaternion_from_angle_axis(by), pose.rotation));
}

/// A point at P in the frame of an image.
void place(Problem& problem, std::size_t point, std::size_t image, Vector3<double> P) {
  const Pose& pose = problem.poses[image];
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  for (std::size_t k = 0; k < 3; ++k) P[k] -= pose.translation[k];
  for (std::size_t k = 0; k < 3; ++k)
    problem.points[3 * point + k] = R[k] * P[0] + R[3 + k] * P[1] + R[6 + k] * P[2];
}

void break_points(Problem& problem, Draw& draw) {
  const std::size_t i = draw.below(problem.num_observations());
  const std::size_t point = problem.observation_point[i], image = problem.observation_image[i];
  switch (draw.below(6)) {
    case 0:
      return place(problem, point, image, {0, 0, 0});
    case 1:
      return place(problem, point, image, {1, 0.5, 0});
    case 2:
      return place(problem, point, image, {0.3, 0.2, draw.one_in(2) ? 3.0 : -3.0});
    case 3: {
      const double size = draw.power(-1, 1);
      for (double& x : problem.points) x += size * draw.normal();
      return;
    }
    case 4:
      for (std::size_t k = 0; k < problem.points.size(); ++k)
        problem.points[k] = problem.points[k % 3];
      return;
    default:
      for (std::size_t k = 0; k < 3; ++k) problem.points[3 * point + k] *= draw.power(3, 9);
  }
}

void break_images(Problem& problem, Draw& draw) {
  const std::size_t image = draw.below(problem.num_images());
  Camera& camera = problem.cameras[problem.image_camera[image]];
  switch (draw.below(6)) {
    case 0:
      for (Pose& pose : problem.poses)
        turn(pose, {0.4 * draw.normal(), 0.4 * draw.normal(), 0.4 * draw.normal()});
      return;
    case 1:
      return turn(problem.poses[image], {3.1, 0, 0});
    case 2:
      problem.poses[image].translation[0] += draw.power(0, 6);
      return;
    case 3:
      problem.poses[image] = problem.poses[0];
      return;
    case 4:
      camera.parameters[0] *= draw.power(-3, 3) * (draw.one_in(4) ? -1 : 1);
      return;
    default:
      camera.parameters[parameter_count(camera.model) - 1] += draw.power(-1, 5);
  }
}

void break_measurements(Problem& problem, Draw& draw) {
  const std::size_t i = draw.below(problem.num_observations());
  if (draw.one_in(2))
    problem.observation_xy[2 * i] += draw.power(1, 100);
  else
    for (std::size_t k = 0; k < 2 * problem.num_observations(); k += 14)
      problem.observation_xy[k] += 200 * draw.normal();
}

Problem broken(Draw& draw, unsigned seed) {
  const CameraModel model = all_models()[draw.below(kCameraModels)];
  Problem problem = disturbed({ordinary(model)}, 3 + draw.below(5), 15 + draw.below(40), seed);
  if (draw.one_in(2)) problem = unshared(problem);
  if (draw.one_in(2)) problem = thinned(problem, seed);
  for (std::size_t k = 0, ways = 1 + draw.below(3); k < ways; ++k) switch (draw.below(3)) {
      case 0:
        break_points(problem, draw);
        break;
      case 1:
        break_images(problem, draw);
        break;
      default:
        break_measurements(problem, draw);
    }
  return problem;
}

SolveOptions some_way(Draw& draw) {
  SolveOptions options;
  options.threads = 1;
  options.max_iterations = 40;
  const CameraSolverKind solvers[] = {
      CameraSolverKind::automatic, CameraSolverKind::dense, CameraSolverKind::sparse,
      CameraSolverKind::iterative_explicit, CameraSolverKind::iterative_implicit};
  options.solver = solvers[draw.below(5)];
  const Loss losses[] = {Loss(), Loss(), Loss(), Loss(Huber{1}), Loss(Cauchy{1}), Loss(Tukey{2})};
  options.loss = losses[draw.below(6)];
  options.cheirality = static_cast<Cheirality>(draw.below(3));
  options.points = static_cast<PointParametrisation>(draw.below(4));
  if (draw.one_in(5)) {
    options.trust_region = TrustRegion::dogleg;
    options.points = PointParametrisation::automatic;
  }
  if (draw.one_in(5)) options.recoveries = 0;
  if (draw.one_in(6)) options.inner_iterations = 0;
  options.fixed.points = draw.one_in(8);
  options.fixed.poses = draw.one_in(8);
  options.fixed.intrinsics = draw.one_in(4);
  return options;
}

void expect_finite_state(const Problem& problem) {
  EXPECT_TRUE(validate(problem).ok());
  for (double x : problem.points) ASSERT_TRUE(std::isfinite(x));
  for (const Camera& camera : problem.cameras)
    for (double x : camera.parameters) ASSERT_TRUE(std::isfinite(x));
}

void expect_falling_costs(const Summary& s) {
  double cost = s.initial_cost;
  int round = 0;
  for (const Iteration& it : s.iterations) {
    if (it.round != round) cost = it.start_cost;
    round = it.round;
    ASSERT_TRUE(std::isfinite(it.cost));
    ASSERT_LE(it.cost, cost * (1 + 1e-9)) << "step " << it.index;
    cost = it.cost;
  }
}

/// Without the observations that were left out.
Evaluation evaluated(Problem problem, const std::vector<std::uint64_t>& left_out) {
  if (left_out.empty()) return evaluate(problem);
  Problem kept = problem;
  kept.observation_image.clear(), kept.observation_point.clear(), kept.observation_xy.clear();
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (!std::binary_search(left_out.begin(), left_out.end(), i))
      kept.add_observation(problem.observation_image[i], problem.observation_point[i],
                           problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]);
  return evaluate(kept);
}

/// Whether a point lies in a camera's plane or at its centre but for rounding: where rounding alone
/// says where its pixel is.
bool is_rounding(const Problem& problem) {
  constexpr double kNear = 1e-7;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const Pose& pose = problem.poses[problem.observation_image[i]];
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    const Vector3<double> P =
        multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{X[0], X[1], X[2]});
    double size = 0;
    for (std::size_t k = 0; k < 3; ++k) size += std::fabs(P[k]) + std::fabs(pose.translation[k]);
    if (std::fabs(P[2] + pose.translation[2]) < kNear * size) return true;
  }
  return false;
}

void expect_right_end(const Summary& s, const SolveOptions& options) {
  const bool nothing = options.fixed.points && options.fixed.poses && options.fixed.intrinsics;
  if (!std::isfinite(s.initial_cost)) {
    EXPECT_EQ(s.termination, Termination::no_usable_step) << s.words;
  } else if (nothing) {
    EXPECT_EQ(s.termination, Termination::nothing_free) << s.words;
  } else {
    EXPECT_NE(s.termination, Termination::nothing_free) << s.words;
  }
  EXPECT_FALSE(s.words.empty());
  EXPECT_EQ(s.words.find("nan"), std::string::npos);
}

TEST(BrokenScenes, EndInOrder) {
  for (int i = 0; i < scenes(); ++i) {
    Draw draw(static_cast<unsigned>(i));
    Problem problem = broken(draw, static_cast<unsigned>(i));
    const SolveOptions options = some_way(draw);
    const Problem before = problem;
    SCOPED_TRACE("scene " + std::to_string(i) + ", " +
                 std::string(to_string(problem.cameras[0].model)));
    const Result<Summary> solved = try_solve(problem, options);
    if (!solved.ok()) {
      EXPECT_EQ(solved.error().code(), ErrorCode::usage) << solved.error().what();
      continue;
    }
    const Summary& s = solved.value();
    expect_finite_state(problem);
    expect_right_end(s, options);
    if (!std::isfinite(s.initial_cost)) {
      EXPECT_EQ(problem.points, before.points);
      continue;
    }
    expect_falling_costs(s);
    const Evaluation end = evaluated(problem, s.rejected_observations);
    if (s.termination == Termination::drowned) {
      EXPECT_NE(s.words.find("observation "), std::string::npos);
      continue;
    }
    if (!(s.final_rms_px < 1e8) || !end.not_finite.empty() || is_rounding(problem)) continue;
    EXPECT_NEAR(end.cost, s.final_plain_cost, 1e-9 * end.cost + 1e-15) << s.words;
  }
}

}  // namespace
}  // namespace sheaf::test
