// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// g2o on a BAL file: fixed-size blocks, rotations as matrices with left turns, exact derivatives by
// hand. The words of --config:
//   eigen | cholmod               linear solver of the reduced camera matrix
//   lambda=1e-2                   first damping (g2o's own rule when absent)
#include <g2o/core/base_binary_edge.h>
#include <g2o/core/base_vertex.h>
#include <g2o/core/block_solver.h>
#include <g2o/core/hyper_graph_action.h>
#include <g2o/core/optimization_algorithm_levenberg.h>
#include <g2o/core/sparse_optimizer.h>
#include <g2o/solvers/eigen/linear_solver_eigen.h>
#ifdef PEER_G2O_CHOLMOD
#include <g2o/solvers/cholmod/linear_solver_cholmod.h>
#endif

#include <Eigen/Geometry>
#include <cstdio>
#include <memory>

#include "bal_camera.h"
#include "bal_file.h"
#include "run_record.h"

namespace {

struct Camera {
  peer::Pose pose;
  double lens[3];  // f, k1, k2
};

class CameraVertex final : public g2o::BaseVertex<9, Camera> {
 public:
  void setToOriginImpl() override { _estimate = {{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}}, {}}; }
  void oplusImpl(const double* step) override {  // turn, translation, lens
    using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Matrix turn;
    peer::rotation(step, turn.data(), nullptr);
    Eigen::Map<Matrix> R(_estimate.pose.R);
    R = (turn * R).eval();
    for (int i = 0; i < 3; ++i) {
      _estimate.pose.t[i] += step[3 + i];
      _estimate.lens[i] += step[6 + i];
    }
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }
};

class PointVertex final : public g2o::BaseVertex<3, g2o::Vector3> {
 public:
  void setToOriginImpl() override { _estimate.setZero(); }
  void oplusImpl(const double* step) override { _estimate += g2o::Vector3::ConstMapType(step); }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }
};

class Observation final : public g2o::BaseBinaryEdge<2, g2o::Vector2, CameraVertex, PointVertex> {
 public:
  void computeError() override {
    double P[3];
    peer::project(camera().pose, camera().lens, point().data(), _measurement.data(), P,
                  _error.data(), nullptr);
  }
  void linearizeOplus() override {
    double P[3], residual[2];
    peer::Derivatives d;
    const peer::Pose& pose = camera().pose;
    peer::project(pose, camera().lens, point().data(), _measurement.data(), P, residual, &d);
    const double q[3] = {P[0] - pose.t[0], P[1] - pose.t[1], P[2] - pose.t[2]};
    for (int r = 0; r < 2; ++r) {
      double turn[3];
      peer::times_minus_cross(d.by_P + 3 * r, q, turn);
      for (int j = 0; j < 3; ++j) {
        _jacobianOplusXi(r, j) = turn[j];
        _jacobianOplusXi(r, 3 + j) = d.by_P[3 * r + j];
        _jacobianOplusXi(r, 6 + j) = d.by_lens[3 * r + j];
        _jacobianOplusXj(r, j) = d.by_P[3 * r] * pose.R[j] + d.by_P[3 * r + 1] * pose.R[3 + j] +
                                 d.by_P[3 * r + 2] * pose.R[6 + j];
      }
    }
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }

 private:
  const Camera& camera() const {
    return static_cast<const CameraVertex*>(_vertices[0])->estimate();
  }
  const g2o::Vector3& point() const {
    return static_cast<const PointVertex*>(_vertices[1])->estimate();
  }
};

/// Records the cost after each step; the flag ends the run at the target or the time limit.
class Watch final : public g2o::HyperGraphAction {
 public:
  Watch(g2o::SparseOptimizer& graph, peer::RunRecord& record, const peer::Arguments& arguments)
      : graph_(graph), record_(record), arguments_(arguments) {
    graph_.setForceStopFlag(&stop_);
  }
  g2o::HyperGraphAction* operator()(const g2o::HyperGraph*, Parameters*) override {
    record();
    return this;
  }
  void record() {
    record_.pause();
    graph_.computeActiveErrors();  // those of the last trial may be left
    const double cost = 0.5 * graph_.activeChi2();
    record_.resume();
    record_.add(cost);
    stop_ = record_.over(arguments_);
  }

 private:
  g2o::SparseOptimizer& graph_;
  peer::RunRecord& record_;
  const peer::Arguments& arguments_;
  bool stop_ = false;
};

using Blocks = g2o::BlockSolver<g2o::BlockSolverTraits<9, 3>>;

std::unique_ptr<Blocks> choose_solver(peer::Config& config) {
#ifdef PEER_G2O_CHOLMOD
  if (config.has("cholmod")) {
    auto linear = std::make_unique<g2o::LinearSolverCholmod<Blocks::PoseMatrixType>>();
    linear->setBlockOrdering(true);
    return std::make_unique<Blocks>(std::move(linear));
  }
#endif
  if (!config.has("eigen")) return nullptr;
  auto linear = std::make_unique<g2o::LinearSolverEigen<Blocks::PoseMatrixType>>();
  linear->setBlockOrdering(true);
  return std::make_unique<Blocks>(std::move(linear));
}

void build(const peer::BalFile& file, g2o::SparseOptimizer& graph) {
  const int cameras = file.camera_count(), points = file.point_count();
  for (int i = 0; i < cameras; ++i) {
    const double* values = &file.cameras[9 * i];
    Camera camera;
    peer::rotation(values, camera.pose.R, nullptr);
    for (int j = 0; j < 3; ++j) {
      camera.pose.t[j] = values[3 + j];
      camera.lens[j] = values[6 + j];
    }
    auto* vertex = new CameraVertex;
    vertex->setId(i);
    vertex->setEstimate(camera);
    graph.addVertex(vertex);
  }
  for (int i = 0; i < points; ++i) {
    auto* vertex = new PointVertex;
    vertex->setId(cameras + i);
    vertex->setEstimate(g2o::Vector3::ConstMapType(&file.points[3 * i]));
    vertex->setMarginalized(true);
    graph.addVertex(vertex);
  }
  for (const auto& o : file.observations) {
    auto* edge = new Observation;
    edge->setVertex(0, graph.vertex(o.camera));
    edge->setVertex(1, graph.vertex(cameras + o.point));
    edge->setMeasurement({o.u, o.v});
    edge->setInformation(g2o::Matrix2::Identity());
    graph.addEdge(edge);
  }
}

void store(const g2o::SparseOptimizer& graph, peer::BalFile& file) {
  const int cameras = file.camera_count(), points = file.point_count();
  for (int i = 0; i < cameras; ++i) {
    const auto& camera = static_cast<const CameraVertex*>(graph.vertex(i))->estimate();
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(camera.pose.R);
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(Eigen::Matrix3d(R)).normalized());
    for (int j = 0; j < 3; ++j) {
      file.cameras[9 * i + j] = turn.angle() * turn.axis()[j];
      file.cameras[9 * i + 3 + j] = camera.pose.t[j];
      file.cameras[9 * i + 6 + j] = camera.lens[j];
    }
  }
  for (int i = 0; i < points; ++i) {
    const auto& X = static_cast<const PointVertex*>(graph.vertex(cameras + i))->estimate();
    for (int j = 0; j < 3; ++j) file.points[3 * i + j] = X[j];
  }
}

int solve(const peer::Arguments& arguments) {
  peer::Config config(arguments.config);
  auto blocks = choose_solver(config);
  const double lambda = config.value("lambda", 0);
  if (!blocks || !config.unknown().empty()) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  peer::BalFile file;
  if (!peer::read_bal(arguments.input, file)) return 3;

  peer::RunRecord record;
  record.start();
  g2o::SparseOptimizer graph;
  auto* levenberg = new g2o::OptimizationAlgorithmLevenberg(std::move(blocks));
  if (lambda > 0) levenberg->setUserLambdaInit(lambda);
  graph.setAlgorithm(levenberg);
  build(file, graph);
  graph.initializeOptimization();
  record.setup_done();
  auto* watch = new Watch(graph, record, arguments);
  watch->record();
  graph.addPostIterationAction(watch);
  graph.optimize(arguments.max_iterations);
  record.finish();
  store(graph, file);
  if (!arguments.output.empty() && !peer::write_bal(arguments.output, file)) return 6;
  std::fputs(record.json("g2o", arguments).c_str(), stdout);
  graph.removePostIterationAction(watch);
  delete watch;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  peer::Arguments arguments;
  if (!peer::parse_arguments(argc, argv, arguments)) return 2;
  if (arguments.test) {
    std::fprintf(stderr, "g2o's derivatives are those that peer-ceres --test checks\n");
    return 2;
  }
  return solve(arguments);
}
