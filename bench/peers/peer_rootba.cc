// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// rootba (Demmel, Sommer, Cremers, Usenko, CVPR 2021; power series: Weber, Demmel, Chan, Cremers,
// CVPR 2023) on a BAL file. The words of --config:
//   schur | sqrt | power          Schur complement, square root, power series as the solver
//   float | double
//   jacobi                        preconditioner instead of Schur-Jacobi
//   expansion                     power series as the preconditioner of schur
//   eta=0.1  radius=1e4  order=10 forcing, first trust region radius, terms of the series
// Its clock starts with its problem in memory and normalised, as its own reader leaves it. In float
// the costs and the state it ends with are rounded.
#include <glog/logging.h>

#include <cstdio>
#include <rootba/bal/bal_problem.hpp>
#include <rootba/bal/solver_options.hpp>
#include <rootba/solver/bal_bundle_adjustment.hpp>
#include <string>

#include "bal_file.h"
#include "line_watch.h"
#include "run_record.h"

namespace {

/// It looks along +z where BAL looks along -z: y and z of cameras and y of images are turned.
template <class Scalar>
rootba::BalProblem<Scalar> make_problem(const peer::BalFile& file) {
  using Vec3 = Eigen::Matrix<double, 3, 1>;
  rootba::BalProblem<Scalar> problem;
  problem.set_quiet(true);
  problem.cameras().resize(file.camera_count());
  problem.landmarks().resize(file.point_count());
  const Sophus::SO3d turned(Vec3(1, -1, -1).asDiagonal().toDenseMatrix());
  for (int i = 0; i < file.camera_count(); ++i) {
    const Eigen::Map<const Eigen::Matrix<double, 9, 1>> values(&file.cameras[9 * i]);
    const Sophus::SE3d cam_from_world(turned * Sophus::SO3d::exp(values.head<3>()),
                                      turned * Vec3(values.segment<3>(3)));
    auto& camera = problem.cameras()[i];
    camera.T_c_w = cam_from_world.template cast<Scalar>();
    camera.intrinsics = basalt::BalCamera<Scalar>(values.tail<3>().template cast<Scalar>());
  }
  for (int i = 0; i < file.point_count(); ++i)
    problem.landmarks()[i].p_w =
        Eigen::Map<const Vec3>(&file.points[3 * i]).template cast<Scalar>();
  for (const auto& o : file.observations)
    problem.landmarks()[o.point].obs[o.camera].pos = {static_cast<Scalar>(o.u),
                                                      static_cast<Scalar>(-o.v)};
  problem.normalize(100);  // its default; the cost stays the same
  return problem;
}

template <class Scalar>
void store(const rootba::BalProblem<Scalar>& problem, peer::BalFile& file) {
  using Vec3 = Eigen::Matrix<double, 3, 1>;
  const Sophus::SO3d turned(Vec3(1, -1, -1).asDiagonal().toDenseMatrix());
  for (int i = 0; i < file.camera_count(); ++i) {
    const auto& camera = problem.cameras()[i];
    const Sophus::SE3d cam_from_world = camera.T_c_w.template cast<double>();
    Eigen::Map<Eigen::Matrix<double, 9, 1>> values(&file.cameras[9 * i]);
    values.head<3>() = (turned * cam_from_world.so3()).log();
    values.segment<3>(3) = turned * cam_from_world.translation();
    values.tail<3>() = camera.intrinsics.getParam().template cast<double>();
  }
  for (int i = 0; i < file.point_count(); ++i)
    Eigen::Map<Vec3>(&file.points[3 * i]) = problem.landmarks()[i].p_w.template cast<double>();
}

/// Target, time or stillness: leaves the solver between two steps.
struct Over {};

template <class Scalar>
void run(const peer::Arguments& arguments, const rootba::SolverOptions& options,
         peer::RunRecord& record, peer::BalFile& file) {
  auto problem = make_problem<Scalar>(file);
  rootba::SolverSummary summary;
  std::size_t seen = 0;
  const auto take_new_steps = [&] {
    for (; seen < summary.iterations.size(); ++seen) {
      const auto& step = summary.iterations[seen];
      if (seen == 0) record.setup_done_at(summary.preprocessor_time_in_seconds);
      record.add_at(step.cumulative_time_in_seconds, step.cost.all.error, step.step_is_successful);
    }
  };
  record.start();
  try {
    const peer::LineWatch watch([&](const std::string& line) {
      if (line.rfind("Iteration ", 0) != 0) return;  // printed before each try
      take_new_steps();
      if (record.over(arguments)) throw Over{};
    });
    rootba::bundle_adjust_manual(problem, options, &summary);
  } catch (const Over&) {
  }
  take_new_steps();
  record.finish();
  store(problem, file);
}

bool choose(peer::Config& config, const peer::Arguments& arguments,
            rootba::SolverOptions& options) {
  using Type = rootba::SolverOptions::SolverType;
  using Preconditioner = rootba::SolverOptions::PreconditionerType;
  const bool schur = config.has("schur"), sqrt = config.has("sqrt"), power = config.has("power");
  options.use_double = config.has("double");
  options.solver_type = sqrt    ? Type::SQUARE_ROOT
                        : power ? Type::POWER_SCHUR_COMPLEMENT
                                : Type::SCHUR_COMPLEMENT;
  if (config.has("jacobi")) options.preconditioner_type = Preconditioner::JACOBI;
  if (config.has("expansion")) options.preconditioner_type = Preconditioner::POWER_SCHUR_COMPLEMENT;
  options.eta = config.value("eta", options.eta);
  options.initial_trust_region_radius = config.value("radius", options.initial_trust_region_radius);
  options.power_order = static_cast<int>(config.value("order", options.power_order));
  options.num_threads = arguments.threads;
  options.max_num_iterations = arguments.max_iterations;
  options.function_tolerance = 0;
  options.verbosity_level = 0;
  return schur + sqrt + power == 1 && options.use_double != config.has("float") &&
         config.unknown().empty();
}

int solve(const peer::Arguments& arguments) {
  peer::Config config(arguments.config);
  rootba::SolverOptions options;
  if (!choose(config, arguments, options)) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  peer::BalFile file;
  if (!peer::read_bal(arguments.input, file)) return 3;
  peer::RunRecord record;
  if (options.use_double) {
    run<double>(arguments, options, record, file);
  } else {
    record.counts_in_float();
    run<float>(arguments, options, record, file);
  }
  if (!arguments.output.empty() && !peer::write_bal(arguments.output, file)) return 6;
  std::fputs(record.json("rootba", arguments).c_str(), stdout);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  peer::Arguments arguments;
  if (!peer::parse_arguments(argc, argv, arguments)) return 2;
  if (!peer::can_hold("rootba", arguments, {})) return 2;
  if (arguments.test) {
    std::fprintf(stderr, "rootba has derivatives of its own: nothing to test here\n");
    return 2;
  }
  google::InitGoogleLogging(argv[0]);
  FLAGS_logtostderr = true;
  FLAGS_minloglevel = 1;
  return solve(arguments);
}
