// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The dogleg of the engine (points eliminated, a plane of two directions, scalars) against the same
// path from the textbook: one dense matrix of cameras and points together.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include "eliminate/kernel_table.h"
#include "geometry/rigid_motion.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"
#include "solve/scenes.h"
#include "solve/textbook.h"
#include "systems/build.h"
#include "systems/point_system.h"

namespace sheaf {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

/// Powell's path in the metric C, in the variables C^1/2 s, where |s|_C is the Euclidean norm.
class DensePath {
 public:
  DensePath(const Normal& normal, double damping) {
    const auto n = static_cast<Eigen::Index>(normal.b.size());
    const Eigen::Map<const Eigen::MatrixXd> H(normal.A.data(), n, n);
    const Eigen::Map<const Eigen::VectorXd> beta(normal.b.data(), n);
    root_ = H.diagonal().cwiseMax(1e-6).cwiseSqrt();
    H_ = root_.cwiseInverse().asDiagonal() * H * root_.cwiseInverse().asDiagonal();
    g_ = beta.cwiseQuotient(root_);
    const Eigen::MatrixXd damped = H_ + damping * Eigen::MatrixXd::Identity(n, n);
    newton_ = damped.ldlt().solve(g_);
    cauchy_ = g_ * (g_.squaredNorm() / g_.dot(damped * g_));
  }

  /// Where the path leaves the radius, found by halving its length parameter.
  Eigen::VectorXd at(double radius) const {
    if (newton_.norm() <= radius) return newton_;
    if (cauchy_.norm() >= radius) return cauchy_ * (radius / cauchy_.norm());
    double low = 0, high = 1;
    for (int i = 0; i < 200; ++i) {
      const double middle = (low + high) / 2;
      ((cauchy_ + middle * (newton_ - cauchy_)).norm() < radius ? low : high) = middle;
    }
    return cauchy_ + low * (newton_ - cauchy_);
  }

  Eigen::VectorXd scaled(const Eigen::VectorXd& s) const { return s.cwiseProduct(root_); }
  double slope(const Eigen::VectorXd& s) const { return g_.dot(s); }
  double curvature(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    return a.dot(H_ * b);
  }
  double decrease(const Eigen::VectorXd& s) const { return g_.dot(s) - s.dot(H_ * s) / 2; }
  std::vector<double> unscaled(const Eigen::VectorXd& s) const {
    const Eigen::VectorXd x = s.cwiseQuotient(root_);
    return {x.data(), x.data() + x.size()};
  }
  const Eigen::VectorXd& newton() const { return newton_; }
  const Eigen::VectorXd& cauchy() const { return cauchy_; }

 private:
  Eigen::VectorXd root_, g_, newton_, cauchy_;
  Eigen::MatrixXd H_;
};

struct Case {
  Fixed fixed{};
  ScaledLoss loss{};
  CameraSolverKind solver = CameraSolverKind::dense;
  double damping = 1e-4;
};

/// A system without inner iterations: the textbook has none.
struct Engine {
  Threads threads{2};
  SolveOptions options;
  std::optional<Build> build;
  std::unique_ptr<Home> home;
  PointSystem& system;
  double damping;
  ScaledLoss loss;

  Engine(const Problem& problem, const Case& c, const Kernels& kernels = *available_kernels()[0])
      : options(options_of(c)),
        build(Build::plan(problem, options, {}, kernels, threads).value()),
        home(build->make_home(problem)),
        system(dynamic_cast<PointSystem&>(*home)),
        damping(c.damping),
        loss(c.loss) {}

  static SolveOptions options_of(const Case& c) {
    SolveOptions out;
    out.fixed = c.fixed;
    out.solver = c.solver;
    out.precision = Precision::full;
    out.trust_region = TrustRegion::dogleg;
    out.inner_iterations = 0;
    return out;
  }

  Step propose(double radius) {
    StepRequest request;
    request.damping = damping;
    request.forcing = 1e-14;
    request.loss = loss;
    request.dogleg = true;
    request.radius = radius;
    return system.propose(request);
  }
};

void expect_textbook_path(const Problem& start, const Case& c) {
  const Places at(start, c.fixed);
  const DensePath path(Normal(start, at, c.loss, Charts(start)), c.damping);
  const double newton = path.newton().norm(), cauchy = path.cauchy().norm();
  Engine engine(start, c);
  EXPECT_LT(cauchy, newton);
  bool first = true;
  for (double radius : {kUnbounded, 2 * newton, 0.9 * newton + 0.1 * cauchy, (newton + cauchy) / 2,
                        1.01 * cauchy, 0.5 * cauchy, 1e-3 * cauchy}) {
    SCOPED_TRACE(testing::Message() << "radius " << radius << " of " << cauchy << " " << newton);
    const Step step = engine.propose(radius);
    EXPECT_TRUE(step.solved);
    EXPECT_EQ(step.reused, !first);
    first = false;
    const Trial trial = engine.system.trial();
    const Eigen::VectorXd s = path.at(radius);
    EXPECT_NEAR(trial.length, std::min(radius, newton), 1e-6 * trial.length);
    EXPECT_NEAR(trial.predicted_decrease, path.decrease(s), 1e-6 * path.decrease(s));
    const Eigen::VectorXd least = path.cauchy() * std::min(1.0, radius / cauchy);
    EXPECT_GE(trial.predicted_decrease, path.decrease(least) * (1 - 1e-9));
    Problem stepped = start;
    move(stepped, at, path.unscaled(s), Charts(start));
    const double cost = robust_cost(stepped, c.loss);
    EXPECT_NEAR(trial.cost, cost, 1e-6 * cost);
    EXPECT_GE(trial.damping, c.damping * (1 - 1e-4));
  }
  // What is held after accept() is the step that was tried last.
  Problem expected = start, taken = start;
  move(expected, at, path.unscaled(path.at(1e-3 * cauchy)), Charts(start));
  engine.system.accept();
  engine.build->store(engine.system, taken);
  for (std::size_t i = 0; i < start.points.size(); ++i)
    EXPECT_NEAR(taken.points[i], expected.points[i], 1e-8 * (1 + std::abs(expected.points[i])));
  EXPECT_FALSE(engine.propose(newton).reused);
}

TEST(Dogleg, IsTheTextbooks) {
  const Problem problem = first_points(small_scene().start, 40);
  for (CameraSolverKind solver : {CameraSolverKind::dense, CameraSolverKind::sparse})
    for (double damping : {1e-4, 1e-2, 1.0}) {
      SCOPED_TRACE(testing::Message() << static_cast<int>(solver) << " " << damping);
      expect_textbook_path(problem, {{}, {}, solver, damping});
    }
}

/// The step between two states, in the textbook's places.
Eigen::VectorXd step_between(const Problem& from, const Problem& to, const Places& at) {
  Eigen::VectorXd s = Eigen::VectorXd::Zero(at.count);
  const auto put = [&](int place, double x) {
    if (place >= 0) s[place] = x;
  };
  for (std::size_t i = 0; i < from.num_images(); ++i) {
    const Quaternion<double> q = from.poses[i].rotation;
    const Vector3<double> phi = angle_axis_from_quaternion(
        multiply(to.poses[i].rotation, Quaternion<double>{q[0], -q[1], -q[2], -q[3]}));
    const RigidMotion<double> turned =
        left_perturbed<double>({q, from.poses[i].translation}, {0, 0, 0}, phi);
    // The translation of exp is linear in rho: its columns are those of the unit vectors.
    Eigen::Matrix3d V;
    Eigen::Vector3d moved;
    for (int k = 0; k < 3; ++k) {
      const Vector3<double> unit{k == 0 ? 1. : 0., k == 1 ? 1. : 0., k == 2 ? 1. : 0.};
      const Vector3<double> column = left_jacobian_times(phi, unit);
      V.col(k) = Eigen::Vector3d(column[0], column[1], column[2]);
      moved[k] = to.poses[i].translation[k] - turned.translation[k];
    }
    const Eigen::Vector3d rho = V.inverse() * moved;
    for (int k = 0; k < 3; ++k) put(at.pose[6 * i + k], rho[k]);
    for (int k = 0; k < 3; ++k) put(at.pose[6 * i + 3 + k], phi[k]);
  }
  for (std::size_t i = 0; i < at.lens.size(); ++i)
    put(at.lens[i],
        to.cameras[i / kMaxCameraParameters].parameters[i % kMaxCameraParameters] -
            from.cameras[i / kMaxCameraParameters].parameters[i % kMaxCameraParameters]);
  for (std::size_t i = 0; i < at.point.size(); ++i) put(at.point[i], to.points[i] - from.points[i]);
  return s;
}

/// Any solver's step keeps within the radius, promises what its model says, and no less than the
/// Cauchy point; asked at once or after a longer one.
void expect_step_within_radius(const Problem& start, const Case& c) {
  const Places at(start, c.fixed);
  const DensePath path(Normal(start, at, c.loss, Charts(start)), c.damping);
  for (double share : {2.0, 0.8, 0.4, 0.1, 1e-2, 1e-4})
    for (bool at_once : {false, true}) {
      const double radius = share * path.newton().norm();
      SCOPED_TRACE(testing::Message()
                   << static_cast<int>(c.solver) << " " << share << " " << at_once);
      Engine engine(start, c);
      if (!at_once) {
        engine.propose(kUnbounded);
        engine.system.trial();
      }
      EXPECT_EQ(engine.propose(radius).reused, !at_once);
      const Trial trial = engine.system.trial();
      Problem stepped = start;
      engine.system.accept();
      engine.build->store(engine.system, stepped);
      const Eigen::VectorXd s = path.scaled(step_between(start, stepped, at));
      EXPECT_NEAR(s.norm(), trial.length, 1e-6 * trial.length);
      EXPECT_LE(trial.length, radius * (1 + 1e-9));
      EXPECT_NEAR(path.decrease(s), trial.predicted_decrease, 1e-6 * trial.predicted_decrease);
      const Eigen::VectorXd least = path.cauchy() * std::min(1.0, radius / path.cauchy().norm());
      EXPECT_GE(trial.predicted_decrease, path.decrease(least) * (1 - 1e-6));
      const double cost = robust_cost(stepped, c.loss);
      EXPECT_NEAR(trial.cost, cost, 1e-9 * cost);
    }
}

TEST(Dogleg, EverySolverKeepsWithinTheRadiusAndItsPromise) {
  const Problem problem = first_points(small_scene().start, 40);
  const Problem shared = first_points(shared_lens_scene(2, false).start, 40);
  Fixed singles;
  singles.pose_ids = {1, 4};
  for (CameraSolverKind solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit}) {
    expect_step_within_radius(problem, {{}, {}, solver});
    expect_step_within_radius(problem, {{}, {}, solver, 1e-2});
    expect_step_within_radius(problem, {{}, {LossKind::huber, 0.5}, solver});
    expect_step_within_radius(problem, {points_held(), {}, solver});
    expect_step_within_radius(problem, {singles, {}, solver});
    expect_step_within_radius(shared, {{}, {}, solver});
  }
}

TEST(Dogleg, IsTheTextbooksWithPartsHeld) {
  const Problem problem = first_points(small_scene().start, 40);
  Fixed singles, poses_held, cameras_held;
  singles.pose_ids = {1, 4};
  singles.camera_ids = {2};
  singles.k2 = true;
  poses_held.poses = true;
  cameras_held.poses = cameras_held.f = cameras_held.k1 = cameras_held.k2 = true;
  for (const Fixed& fixed : {singles, poses_held, cameras_held})
    expect_textbook_path(problem, {fixed});
  expect_textbook_path(problem, {points_held()});
  expect_textbook_path(problem, {points_held(), {}, CameraSolverKind::automatic});
}

TEST(Dogleg, IsTheTextbooksWithALoss) {
  const Problem problem = first_points(small_scene().start, 40);
  for (const ScaledLoss& loss : {ScaledLoss{LossKind::huber, 0.5}, ScaledLoss{LossKind::cauchy, 1}})
    expect_textbook_path(problem, {{}, loss});
  expect_textbook_path(problem, {points_held(), {LossKind::huber, 0.5}});
}

TEST(Dogleg, IsTheTextbooksWithSharedLenses) {
  for (std::uint32_t together : {2u, 12u}) {
    const Problem problem = first_points(shared_lens_scene(together, true).start, 40);
    expect_textbook_path(problem, {});
    expect_textbook_path(problem, {points_held()});
  }
}

/// No step of the plane within the radius promises more, by trying many.
TEST(Dogleg, TheBestStepOfThePlaneIsTheBest) {
  const Problem problem = first_points(small_scene().start, 40);
  const Places at(problem, {});
  const DensePath path(Normal(problem, at, {}, Charts(problem)), 1e-4);
  // v and some direction that is no Newton point.
  const Eigen::VectorXd v = path.cauchy(), n = path.newton() + 3 * path.newton().cwiseAbs();
  const DoglegPlane plane{v.squaredNorm(),      path.curvature(v, v), v.dot(n), n.squaredNorm(),
                          path.curvature(v, n), path.curvature(n, n), 0};
  const double slope = path.slope(v) / v.squaredNorm();  // beta = slope v in these variables
  ASSERT_NEAR(path.slope(n), slope * v.dot(n), 1e-9 * std::abs(path.slope(n)));
  for (double radius : {0.01 * v.norm(), v.norm(), 10 * v.norm(), 1e6 * n.norm()}) {
    DoglegPlane scaled = plane;  // v is the gradient itself there: beta.v = |v|^2
    scaled.vHv /= slope, scaled.vHn /= slope, scaled.nHn /= slope;
    const DoglegStep best = best_in_plane(scaled, radius);
    EXPECT_LE(length_of(scaled, best), radius * (1 + 1e-9));
    const double most = decrease_of(scaled, best);
    for (int i = 0; i < 1000; ++i) {
      const double angle = 2 * 3.14159265358979 * i / 1000;
      DoglegStep other{std::cos(angle), std::sin(angle) * std::sqrt(scaled.nn / scaled.vv)};
      for (double share : {1.0, 0.7, 0.2, 0.01}) {
        const double to = share * radius / length_of(scaled, other);
        const DoglegStep tried{other.newton * to, other.descent * to};
        EXPECT_LE(decrease_of(scaled, tried), most * (1 + 1e-9));
      }
    }
  }
}

/// The kernels of this machine, counting linearisations; without a linearisation nothing new can be
/// factored.
std::atomic<int> linearized{0};
const Kernels& counting_kernels() {
  static const Kernels kernels = [] {
    Kernels k = *available_kernels()[0];
    k.linearize = [](const EliminateInput& in, const Chunk& chunk, const Records& records,
                     EliminateOutput& out) {
      ++linearized;
      available_kernels()[0]->linearize(in, chunk, records, out);
    };
    return k;
  }();
  return kernels;
}

TEST(Dogleg, ASmallerRadiusNeedsNoNewLinearization) {
  for (CameraSolverKind solver :
       {CameraSolverKind::dense, CameraSolverKind::sparse, CameraSolverKind::iterative_explicit,
        CameraSolverKind::iterative_implicit}) {
    const Problem problem = small_scene().start;
    Engine engine(problem, {{}, {}, solver, 1e-6}, counting_kernels());
    linearized = 0;
    engine.propose(kUnbounded);
    const int once = linearized;
    EXPECT_GT(once, 0);
    double length = engine.system.trial().length;
    for (int i = 0; i < 5; ++i) {
      length /= 3;
      const Step step = engine.propose(length);
      EXPECT_TRUE(step.reused);
      EXPECT_EQ(step.linear_iterations, 0);
      EXPECT_NEAR(engine.system.trial().length, length, 1e-9 * length);
    }
    EXPECT_EQ(linearized, once);
    EXPECT_EQ(engine.system.camera_solves(), 1u);
    engine.system.accept();
    EXPECT_FALSE(engine.propose(length).reused);
    EXPECT_EQ(linearized, 2 * once);
    EXPECT_EQ(engine.system.camera_solves(), 2u);
  }
}

TEST(Dogleg, MoreDampingOrAnotherLossIsAnotherSystem) {
  Engine engine(small_scene().start, {});
  engine.propose(kUnbounded);
  EXPECT_TRUE(engine.propose(1).reused);
  engine.damping *= 2;
  EXPECT_FALSE(engine.propose(1).reused);
  engine.loss = {LossKind::huber, 1};
  EXPECT_FALSE(engine.propose(1).reused);
}

/// A start from which steps are rejected.
Problem bad_start() {
  SceneOptions options;
  options.images = 40;
  options.points = 9000;
  options.mean_track = 5;
  Problem problem = generate(options).value().truth;
  disturb(problem, {0.05, 0.05, 0.2, 0.05, 1});
  return problem;
}

TEST(Dogleg, ThreadsDoNotChangeABit) {
  const Problem start = bad_start();
  for (CameraSolverKind solver : {CameraSolverKind::dense, CameraSolverKind::iterative_implicit})
    for (const Loss& loss : {Loss(), Loss(Huber{1})}) {
      SolveOptions options;
      options.trust_region = TrustRegion::dogleg;
      options.initial_damping = 1e-9;
      options.solver = solver;
      options.loss = loss;
      options.max_iterations = 12;
      options.threads = 1;
      Problem expected = start;
      const Summary reference = solve(expected, options);
      const bool reused = std::any_of(reference.iterations.begin(), reference.iterations.end(),
                                      [](const Iteration& it) { return it.reused; });
      EXPECT_TRUE(reused || loss.kind != LossKind::none) << "under a loss no step is rejected here";
      for (int threads : {2, 5}) {
        options.threads = threads;
        Problem problem = start;
        const Summary s = solve(problem, options);
        EXPECT_EQ(problem.points, expected.points);
        ASSERT_EQ(s.iterations.size(), reference.iterations.size());
        for (std::size_t i = 0; i < s.iterations.size(); ++i) {
          EXPECT_EQ(s.iterations[i].cost, reference.iterations[i].cost);
          EXPECT_EQ(s.iterations[i].radius, reference.iterations[i].radius);
        }
      }
    }
}

// A dogleg whose Newton points are all taken is Levenberg-Marquardt, to the last bit.
TEST(Dogleg, WithoutARejectionIsLevenbergMarquardt) {
  const Problem start = small_scene().start;
  for (CameraSolverKind solver : {CameraSolverKind::dense, CameraSolverKind::iterative_explicit}) {
    SolveOptions options;
    options.solver = solver;
    Problem lm = start, dogleg = start;
    const Summary expected = solve(lm, options);
    options.trust_region = TrustRegion::dogleg;
    const Summary s = solve(dogleg, options);
    EXPECT_EQ(dogleg.points, lm.points);
    for (const Iteration& it : s.iterations) EXPECT_TRUE(it.accepted);
    EXPECT_EQ(s.iterations.size(), expected.iterations.size());
  }
}

TEST(Dogleg, PutsNoPointBehindWhenAskedNotTo) {
  Problem problem = bad_start();
  SolveOptions options;
  options.trust_region = TrustRegion::dogleg;
  options.initial_damping = 1e-9;
  options.cheirality = Cheirality::reject;
  const Summary s = solve(problem, options);
  EXPECT_TRUE(s.usable());
  EXPECT_LT(s.final_cost, 0.5 * s.initial_cost);
  EXPECT_TRUE(std::includes(s.behind_camera_before.begin(), s.behind_camera_before.end(),
                            s.behind_camera_after.begin(), s.behind_camera_after.end()));
}

}  // namespace
}  // namespace sheaf
