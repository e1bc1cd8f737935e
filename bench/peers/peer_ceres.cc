// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Ceres on a BAL file. The words of --config:
//   dense_schur | sparse_schur | iterative_implicit | iterative_explicit    the camera solver
//   dense_normal | sparse_normal  normal equations without elimination: for cameras or points alone
//   analytic | auto               derivatives by hand or by Ceres' jets
//   jacobi | schur_jacobi         preconditioner of the iterative ones (schur_jacobi)
//   lapack                        dense factorisation by LAPACK instead of Eigen
//   mixed                         float factor with refinement
//   eta=0.1  radius=1e4           forcing, first trust region radius
//   huber=1.5 | soft_l1=1.5 | cauchy=1.5 | tukey=1.5    a loss with its scale in pixels
//   inner                         inner iterations of the points, as sheaf takes
//   nonmonotonic                  steps may go up for a while; what counts is the best state so far
//   nok2                          holds k2, as --fix k2
// --fix takes points, poses, intrinsics, f, k1, k2.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>

#include "bal_camera.h"
#include "bal_file.h"
#include "run_record.h"

namespace {

using peer::camera_size;

/// The residual as a template for automatic differentiation.
struct Projection {
  double u, v;

  template <class T>
  bool operator()(const T* camera, const T* X, T* residual) const {
    T P[3];
    ceres::AngleAxisRotatePoint(camera, X, P);
    P[0] += camera[3];
    P[1] += camera[4];
    P[2] += camera[5];
    const T x = -P[0] / P[2];
    const T y = -P[1] / P[2];
    const T n = x * x + y * y;
    const T scale = camera[6] * (1.0 + n * (camera[7] + camera[8] * n));
    residual[0] = scale * x - u;
    residual[1] = scale * y - v;
    return true;
  }
};

/// The same with exact derivatives by hand.
class AnalyticProjection final : public ceres::SizedCostFunction<2, camera_size, 3> {
 public:
  AnalyticProjection(double u, double v) : measured_{u, v} {}

  bool Evaluate(const double* const* blocks, double* residual, double** jacobians) const override {
    const double *camera = blocks[0], *X = blocks[1];
    double* by_camera = jacobians ? jacobians[0] : nullptr;
    double* by_point = jacobians ? jacobians[1] : nullptr;
    peer::Pose pose{{}, {camera[3], camera[4], camera[5]}};
    double turn[9], P[3];
    peer::rotation(camera, pose.R, by_camera ? turn : nullptr);
    peer::Derivatives d;
    peer::project(pose, camera + 6, X, measured_, P, residual, jacobians ? &d : nullptr);
    if (by_camera) fill_camera(pose, turn, P, d, by_camera);
    if (by_point) {
      for (int r = 0; r < 2; ++r)
        for (int j = 0; j < 3; ++j)
          by_point[3 * r + j] = d.by_P[3 * r] * pose.R[j] + d.by_P[3 * r + 1] * pose.R[3 + j] +
                                d.by_P[3 * r + 2] * pose.R[6 + j];
    }
    return true;
  }

 private:
  /// d(R(w) X)/dw = -[R X]x J(w), J the left Jacobian (`turn`).
  static void fill_camera(const peer::Pose& pose, const double* turn, const double* P,
                          const peer::Derivatives& d, double* by_camera) {
    const double q[3] = {P[0] - pose.t[0], P[1] - pose.t[1], P[2] - pose.t[2]};
    for (int r = 0; r < 2; ++r) {
      double* row = by_camera + camera_size * r;
      double by_turn[3];
      peer::times_minus_cross(d.by_P + 3 * r, q, by_turn);
      for (int j = 0; j < 3; ++j) {
        row[j] = by_turn[0] * turn[j] + by_turn[1] * turn[3 + j] + by_turn[2] * turn[6 + j];
        row[3 + j] = d.by_P[3 * r + j];
        row[6 + j] = d.by_lens[3 * r + j];
      }
    }
  }

  double measured_[2];
};

using AutoProjection = ceres::AutoDiffCostFunction<Projection, 2, camera_size, 3>;

/// Largest difference between the two derivatives, relative to each row's largest entry.
int test_derivatives() {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  double worst = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    // Ceres drops the second order below 1e-8, so its own derivative errs by about the angle there.
    const double turn = trial % 4 == 0 ? 1e-12 : trial % 4 == 1 ? 1e-4 : 1.0;
    double camera[9], X[3];
    for (int i = 0; i < 3; ++i) {
      camera[i] = turn * normal(random);
      camera[3 + i] = normal(random);
      X[i] = normal(random) - (i == 2 ? 5 : 0);
    }
    camera[6] = 500 + 50 * normal(random), camera[7] = 0.1 * normal(random);
    camera[8] = 0.1 * normal(random);
    const double* blocks[2] = {camera, X};
    double values[2][2], jacobian[2][2 * 12];
    double* auto_jacobian[2] = {jacobian[0], jacobian[0] + 18};
    double* own_jacobian[2] = {jacobian[1], jacobian[1] + 18};
    AutoProjection(new Projection{3, 4}).Evaluate(blocks, values[0], auto_jacobian);
    AnalyticProjection(3, 4).Evaluate(blocks, values[1], own_jacobian);
    double largest = 0, difference = 0;
    for (int i = 0; i < 24; ++i) {
      largest = std::max(largest, std::abs(jacobian[0][i]));
      difference = std::max(difference, std::abs(jacobian[0][i] - jacobian[1][i]));
    }
    worst = std::max(worst, difference / largest);
    worst = std::max(worst, std::abs(values[0][0] - values[1][0]) / largest);
  }
  std::printf("derivatives by hand and automatic differ by %.1e\n", worst);
  return worst < 1e-10 ? 0 : 1;
}

/// Records each accepted cost and ends the run at the target or the time limit.
class Watch final : public ceres::IterationCallback {
 public:
  Watch(peer::RunRecord& record, const peer::Arguments& arguments)
      : record_(record), arguments_(arguments) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    record_.add(step.cost, step.step_is_successful);
    return record_.over(arguments_) ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  peer::RunRecord& record_;
  const peer::Arguments& arguments_;
};

bool choose_solver(peer::Config& config, ceres::Solver::Options& options) {
  if (config.has("dense_schur")) {
    options.linear_solver_type = ceres::DENSE_SCHUR;
  } else if (config.has("sparse_schur")) {
    options.linear_solver_type = ceres::SPARSE_SCHUR;
  } else if (config.has("dense_normal")) {
    options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  } else if (config.has("sparse_normal")) {
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  } else if (config.has("iterative_implicit") || config.has("iterative_explicit")) {
    options.linear_solver_type = ceres::ITERATIVE_SCHUR;
    options.use_explicit_schur_complement = config.has("iterative_explicit");
    const bool jacobi = config.has("jacobi") && !config.has("schur_jacobi");
    options.preconditioner_type = jacobi ? ceres::JACOBI : ceres::SCHUR_JACOBI;
  } else {
    return false;
  }
  if (config.has("lapack")) options.dense_linear_algebra_library_type = ceres::LAPACK;
  if (config.has("mixed")) {
    options.use_mixed_precision_solves = true;
    options.max_num_refinement_iterations = 3;
  }
  options.eta = config.value("eta", 0.1);
  options.initial_trust_region_radius = config.value("radius", 1e4);
  options.use_nonmonotonic_steps = config.has("nonmonotonic");
  return true;
}

/// Null: none. The problem, which takes it, may have it for all its observations.
ceres::LossFunction* choose_loss(peer::Config& config) {
  if (const double c = config.value("huber", 0); c > 0) return new ceres::HuberLoss(c);
  if (const double c = config.value("soft_l1", 0); c > 0) return new ceres::SoftLOneLoss(c);
  if (const double c = config.value("cauchy", 0); c > 0) return new ceres::CauchyLoss(c);
  if (const double c = config.value("tukey", 0); c > 0) return new ceres::TukeyLoss(c);
  return nullptr;
}

/// What a run adds to Ceres' solver options.
struct Words {
  bool analytic, inner, hold_points;
  std::vector<int> held;  // of a camera's nine parameters
  ceres::LossFunction* loss;
};

std::vector<int> held_parameters(const std::set<std::string>& fix, bool hold_k2) {
  const std::vector<std::pair<std::string, std::vector<int>>> meanings = {
      {"poses", {0, 1, 2, 3, 4, 5}},
      {"intrinsics", {6, 7, 8}},
      {"f", {6}},
      {"k1", {7}},
      {"k2", {8}}};
  std::set<int> out;
  for (const auto& [word, parameters] : meanings)
    if (fix.count(word) > 0) out.insert(parameters.begin(), parameters.end());
  if (hold_k2) out.insert(8);
  return {out.begin(), out.end()};
}

/// What --fix and the words hold.
void hold(const std::vector<double*>& blocks, const Words& words, ceres::Problem& problem) {
  const bool whole = words.held.size() == camera_size;
  ceres::Manifold* part =
      words.held.empty() || whole ? nullptr : new ceres::SubsetManifold(camera_size, words.held);
  for (double* block : blocks) {
    const bool camera = problem.ParameterBlockSize(block) == camera_size;
    if (camera ? whole : words.hold_points)
      problem.SetParameterBlockConstant(block);
    else if (camera && part != nullptr)
      problem.SetManifold(block, part);
  }
}

void build(peer::BalFile& file, const Words& words, ceres::Problem& problem,
           ceres::Solver::Options& options) {
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const auto& o : file.observations) {
    ceres::CostFunction* cost = nullptr;
    if (words.analytic)
      cost = new AnalyticProjection(o.u, o.v);
    else
      cost = new AutoProjection(new Projection{o.u, o.v});
    problem.AddResidualBlock(cost, words.loss, &file.cameras[camera_size * o.camera],
                             &file.points[3 * o.point]);
  }
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  for (double* block : blocks)
    order->AddElementToGroup(block, problem.ParameterBlockSize(block) == 3 ? 0 : 1);
  // Ceres takes the order for Schur's elimination, or as a fill-reducing one, which it has itself.
  if (ceres::IsSchurType(options.linear_solver_type)) options.linear_solver_ordering = order;
  options.use_inner_iterations = words.inner;
  if (words.inner) {
    options.inner_iteration_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (double* block : blocks)
      if (problem.ParameterBlockSize(block) == 3)
        options.inner_iteration_ordering->AddElementToGroup(block, 0);
  }
  hold(blocks, words, problem);
}

int solve(const peer::Arguments& arguments) {
  peer::Config config(arguments.config);
  ceres::Solver::Options options;
  const Words words{config.has("analytic"), config.has("inner"), arguments.fix.count("points") > 0,
                    held_parameters(arguments.fix, config.has("nok2")), choose_loss(config)};
  const bool known = choose_solver(config, options) && words.analytic != config.has("auto");
  if (!known || !config.unknown().empty()) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  peer::BalFile file;
  if (!peer::read_bal(arguments.input, file)) return 3;

  peer::RunRecord record;
  if (options.use_nonmonotonic_steps) record.ends_with_best();
  record.start();
  ceres::Problem problem;
  build(file, words, problem, options);
  record.setup_done();
  options.num_threads = arguments.threads;
  options.max_num_iterations = arguments.max_iterations;
  // Only the target, the time and the count end a run.
  options.function_tolerance = 0;
  options.gradient_tolerance = 0;
  options.parameter_tolerance = 0;
  options.max_solver_time_in_seconds = std::min(arguments.time_limit_s, 1e9);
  options.logging_type = ceres::SILENT;
  Watch watch(record, arguments);
  options.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  record.finish();
  if (!arguments.output.empty() && !peer::write_bal(arguments.output, file)) return 6;
  std::fputs(record.json("ceres-" CERES_VERSION_STRING, arguments).c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  peer::Arguments arguments;
  if (!peer::parse_arguments(argc, argv, arguments)) return 2;
  const std::set<std::string> able = {"points", "poses", "intrinsics", "f", "k1", "k2"};
  if (!peer::can_hold("Ceres", arguments, able)) return 2;
  return arguments.test ? test_derivatives() : solve(arguments);
}
