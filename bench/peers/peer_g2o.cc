// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// g2o on a BAL file: fixed-size blocks, rotations as matrices with left turns, exact derivatives by
// hand. The words of --config:
//   eigen | cholmod               linear solver of the reduced camera matrix
//   lambda=1e-2                   first damping (g2o's own rule when absent)
//   huber=1.5 | cauchy=1.5        a loss with its scale in pixels; the trace has its cost
//   vertices                      points that are held stay vertices of the graph, marked as fixed;
//                                 without it they are constants of edges with one vertex, which is
//                                 quicker
// --fix takes points, intrinsics. A step that g2o tries and refuses within one of its iterations is
// a step of its own here, as it is with every other solver.
#include <g2o/core/base_binary_edge.h>
#include <g2o/core/base_unary_edge.h>
#include <g2o/core/base_vertex.h>
#include <g2o/core/block_solver.h>
#include <g2o/core/hyper_graph_action.h>
#include <g2o/core/optimization_algorithm_levenberg.h>
#include <g2o/core/robust_kernel_impl.h>
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

/// Size 9, or 6 with the lens held.
template <int Size>
class CameraVertex final : public g2o::BaseVertex<Size, Camera> {
 public:
  void setToOriginImpl() override { this->_estimate = {{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {}}, {}}; }
  void oplusImpl(const double* step) override {  // turn, translation, lens
    using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    Camera& camera = this->_estimate;
    Matrix turn;
    peer::rotation(step, turn.data(), nullptr);
    Eigen::Map<Matrix> R(camera.pose.R);
    R = (turn * R).eval();
    for (int i = 0; i < 3; ++i) camera.pose.t[i] += step[3 + i];
    if constexpr (Size == 9)
      for (int i = 0; i < 3; ++i) camera.lens[i] += step[6 + i];
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

/// The derivatives by a camera's step into `J` (2 x its size), and by P = R X + t into by_P.
template <class Matrix>
void fill_camera(const Camera& camera, const double* X, const double* measured, Matrix& J,
                 double* by_P) {
  double P[3], residual[2];
  peer::Derivatives d;
  peer::project(camera.pose, camera.lens, X, measured, P, residual, &d);
  const double* t = camera.pose.t;
  const double q[3] = {P[0] - t[0], P[1] - t[1], P[2] - t[2]};
  for (int r = 0; r < 2; ++r) {
    double turn[3];
    peer::times_minus_cross(d.by_P + 3 * r, q, turn);
    for (int j = 0; j < 3; ++j) {
      J(r, j) = turn[j];
      J(r, 3 + j) = d.by_P[3 * r + j];
      if constexpr (Matrix::ColsAtCompileTime == 9) J(r, 6 + j) = d.by_lens[3 * r + j];
    }
  }
  std::copy(d.by_P, d.by_P + 6, by_P);
}

template <int Size>
class Observation final
    : public g2o::BaseBinaryEdge<2, g2o::Vector2, CameraVertex<Size>, PointVertex> {
 public:
  void computeError() override {
    double P[3];
    peer::project(camera().pose, camera().lens, point().data(), this->_measurement.data(), P,
                  this->_error.data(), nullptr);
  }
  void linearizeOplus() override {
    double by_P[6];
    fill_camera(camera(), point().data(), this->_measurement.data(), this->_jacobianOplusXi, by_P);
    if (static_cast<const PointVertex*>(this->_vertices[1])->fixed()) return;
    const double* R = camera().pose.R;
    for (int r = 0; r < 2; ++r)
      for (int j = 0; j < 3; ++j)
        this->_jacobianOplusXj(r, j) =
            by_P[3 * r] * R[j] + by_P[3 * r + 1] * R[3 + j] + by_P[3 * r + 2] * R[6 + j];
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }

 private:
  const Camera& camera() const {
    return static_cast<const CameraVertex<Size>*>(this->_vertices[0])->estimate();
  }
  const g2o::Vector3& point() const {
    return static_cast<const PointVertex*>(this->_vertices[1])->estimate();
  }
};

/// Of a point that is held.
template <int Size>
class HeldObservation final : public g2o::BaseUnaryEdge<2, g2o::Vector2, CameraVertex<Size>> {
 public:
  explicit HeldObservation(const double* X) : X_{X[0], X[1], X[2]} {}
  void computeError() override {
    double P[3];
    peer::project(camera().pose, camera().lens, X_, this->_measurement.data(), P,
                  this->_error.data(), nullptr);
  }
  void linearizeOplus() override {
    double by_P[6];
    fill_camera(camera(), X_, this->_measurement.data(), this->_jacobianOplusXi, by_P);
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }

 private:
  const Camera& camera() const {
    return static_cast<const CameraVertex<Size>*>(this->_vertices[0])->estimate();
  }
  double X_[3];
};

/// When the linear solver was asked: once for each try of a step.
class Tries {
 public:
  explicit Tries(const peer::RunRecord& record) : record_(record) {}
  void begin() { begun_s_.push_back(record_.now()); }
  /// Seconds of all tries but the last, which is what the iteration ends with.
  std::vector<double> take_refused() {
    std::vector<double> out;
    for (std::size_t k = 1; k < begun_s_.size(); ++k) out.push_back(begun_s_[k] - begun_s_[k - 1]);
    begun_s_.clear();
    return out;
  }

 private:
  const peer::RunRecord& record_;
  std::vector<double> begun_s_;
};

template <template <class> class Solver, class Matrix>
class Watched final : public Solver<Matrix> {
 public:
  explicit Watched(Tries& tries) : tries_(tries) {}
  bool solve(const g2o::SparseBlockMatrix<Matrix>& A, double* x, double* b) override {
    tries_.begin();
    return Solver<Matrix>::solve(A, x, b);
  }

 private:
  Tries& tries_;
};

/// Records the cost after each step; the flag ends the run at the target or the time limit.
class Watch final : public g2o::HyperGraphAction {
 public:
  Watch(g2o::SparseOptimizer& graph, Tries& tries, peer::RunRecord& record,
        const peer::Arguments& arguments)
      : graph_(graph), tries_(tries), record_(record), arguments_(arguments) {
    graph_.setForceStopFlag(&stop_);
  }
  g2o::HyperGraphAction* operator()(const g2o::HyperGraph*, Parameters*) override {
    record();
    return this;
  }
  void record() {
    record_.pause();
    graph_.computeActiveErrors();  // those of the last trial may be left
    const double cost = 0.5 * graph_.activeRobustChi2();
    record_.resume();
    record_.add_with_tries(cost, tries_.take_refused());
    stop_ = record_.over(arguments_);
  }

 private:
  g2o::SparseOptimizer& graph_;
  Tries& tries_;
  peer::RunRecord& record_;
  const peer::Arguments& arguments_;
  bool stop_ = false;
};

/// What the words and --fix ask for.
struct Plan {
  bool cholmod, eigen;
  double lambda;
  bool hold_points, as_vertices;
  double huber, cauchy;  // scales of a loss in px; 0: not that one
};

/// A new one for each observation, which owns it; null without a loss.
g2o::RobustKernel* new_kernel(const Plan& plan) {
  g2o::RobustKernel* kernel = nullptr;
  if (plan.huber > 0) {
    kernel = new g2o::RobustKernelHuber;
    kernel->setDelta(plan.huber);
  } else if (plan.cauchy > 0) {
    kernel = new g2o::RobustKernelCauchy;
    kernel->setDelta(plan.cauchy);
  }
  return kernel;
}

template <int Size>
std::unique_ptr<g2o::Solver> choose_solver(const Plan& plan, Tries& tries) {
  using Blocks = g2o::BlockSolver<g2o::BlockSolverTraits<Size, 3>>;
  using Matrix = typename Blocks::PoseMatrixType;
#ifdef PEER_G2O_CHOLMOD
  if (plan.cholmod) {
    auto linear = std::make_unique<Watched<g2o::LinearSolverCholmod, Matrix>>(tries);
    linear->setBlockOrdering(true);
    return std::make_unique<Blocks>(std::move(linear));
  }
#endif
  if (!plan.eigen) return nullptr;
  auto linear = std::make_unique<Watched<g2o::LinearSolverEigen, Matrix>>(tries);
  linear->setBlockOrdering(true);
  return std::make_unique<Blocks>(std::move(linear));
}

template <int Size>
void add_cameras(const peer::BalFile& file, g2o::SparseOptimizer& graph) {
  for (int i = 0; i < file.camera_count(); ++i) {
    const double* values = &file.cameras[9 * i];
    Camera camera;
    peer::rotation(values, camera.pose.R, nullptr);
    for (int j = 0; j < 3; ++j) {
      camera.pose.t[j] = values[3 + j];
      camera.lens[j] = values[6 + j];
    }
    auto* vertex = new CameraVertex<Size>;
    vertex->setId(i);
    vertex->setEstimate(camera);
    graph.addVertex(vertex);
  }
}

template <int Size>
void build(const peer::BalFile& file, const Plan& plan, g2o::SparseOptimizer& graph) {
  add_cameras<Size>(file, graph);
  const int cameras = file.camera_count();
  const auto add = [&](auto* edge, const peer::BalFile::Observation& o) {
    edge->setVertex(0, graph.vertex(o.camera));
    edge->setMeasurement({o.u, o.v});
    edge->setInformation(g2o::Matrix2::Identity());
    edge->setRobustKernel(new_kernel(plan));
    graph.addEdge(edge);
  };
  if (plan.hold_points && !plan.as_vertices) {
    for (const auto& o : file.observations)
      add(new HeldObservation<Size>(&file.points[3 * o.point]), o);
    return;
  }
  for (int i = 0; i < file.point_count(); ++i) {
    auto* vertex = new PointVertex;
    vertex->setId(cameras + i);
    vertex->setEstimate(g2o::Vector3::ConstMapType(&file.points[3 * i]));
    vertex->setFixed(plan.hold_points);
    vertex->setMarginalized(!plan.hold_points);
    graph.addVertex(vertex);
  }
  for (const auto& o : file.observations) {
    auto* edge = new Observation<Size>;
    edge->setVertex(1, graph.vertex(cameras + o.point));
    add(edge, o);
  }
}

template <int Size>
void store(const g2o::SparseOptimizer& graph, const Plan& plan, peer::BalFile& file) {
  const int cameras = file.camera_count();
  for (int i = 0; i < cameras; ++i) {
    const auto& camera = static_cast<const CameraVertex<Size>*>(graph.vertex(i))->estimate();
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(camera.pose.R);
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(Eigen::Matrix3d(R)).normalized());
    for (int j = 0; j < 3; ++j) {
      file.cameras[9 * i + j] = turn.angle() * turn.axis()[j];
      file.cameras[9 * i + 3 + j] = camera.pose.t[j];
      file.cameras[9 * i + 6 + j] = camera.lens[j];
    }
  }
  if (plan.hold_points) return;
  for (int i = 0; i < file.point_count(); ++i) {
    const auto& X = static_cast<const PointVertex*>(graph.vertex(cameras + i))->estimate();
    for (int j = 0; j < 3; ++j) file.points[3 * i + j] = X[j];
  }
}

template <int Size>
int solve(const peer::Arguments& arguments, const Plan& plan) {
  peer::RunRecord record;
  Tries tries(record);
  auto blocks = choose_solver<Size>(plan, tries);
  if (!blocks) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  peer::BalFile file;
  if (!peer::read_bal(arguments.input, file)) return 3;

  record.start();
  g2o::SparseOptimizer graph;
  auto* levenberg = new g2o::OptimizationAlgorithmLevenberg(std::move(blocks));
  if (plan.lambda > 0) levenberg->setUserLambdaInit(plan.lambda);
  graph.setAlgorithm(levenberg);
  build<Size>(file, plan, graph);
  graph.initializeOptimization();
  record.setup_done();
  auto* watch = new Watch(graph, tries, record, arguments);
  watch->record();
  graph.addPostIterationAction(watch);
  graph.optimize(arguments.max_iterations);
  record.finish();
  store<Size>(graph, plan, file);
  if (!arguments.output.empty() && !peer::write_bal(arguments.output, file)) return 6;
  std::fputs(record.json("g2o", arguments).c_str(), stdout);
  graph.removePostIterationAction(watch);
  delete watch;
  return 0;
}

int solve(const peer::Arguments& arguments) {
  peer::Config config(arguments.config);
  const Plan plan{config.has("cholmod"),     config.has("eigen"),
                  config.value("lambda", 0), arguments.fix.count("points") > 0,
                  config.has("vertices"),    config.value("huber", 0),
                  config.value("cauchy", 0)};
  if (!config.unknown().empty()) {
    std::fprintf(stderr, "unknown configuration '%s'\n", arguments.config.c_str());
    return 2;
  }
  return arguments.fix.count("intrinsics") > 0 ? solve<6>(arguments, plan)
                                               : solve<9>(arguments, plan);
}

}  // namespace

int main(int argc, char** argv) {
  peer::Arguments arguments;
  if (!peer::parse_arguments(argc, argv, arguments)) return 2;
  if (arguments.test) {
    std::fprintf(stderr, "g2o's derivatives are those that peer-ceres --test checks\n");
    return 2;
  }
  if (!peer::can_hold("g2o", arguments, {"points", "intrinsics"})) return 2;
  return solve(arguments);
}
