// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// g2o on a folder of images with poses.txt and points.txt, as the photometric exercise is usually
// solved: points in the world, sixteen pixels that move with their middle, bilinear greys, slopes
// by central differences, Huber 1 on a patch's norm, patches outside for nothing. Shares no code
// with Sheaf.
//   peer-g2o-photometric FOLDER FX FY CX CY [ITERATIONS]
#include <g2o/core/base_binary_edge.h>
#include <g2o/core/base_vertex.h>
#include <g2o/core/block_solver.h>
#include <g2o/core/optimization_algorithm_levenberg.h>
#include <g2o/core/robust_kernel_impl.h>
#include <g2o/core/sparse_optimizer.h>
#include <g2o/solvers/eigen/linear_solver_eigen.h>
#include <png.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

namespace {

double fx, fy, cx, cy;

struct Grey {
  int width = 0, height = 0;
  std::vector<float> pixels;

  bool read(const std::string& path) {
    png_image png{};
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_file(&png, path.c_str()) == 0) return false;
    png.format = PNG_FORMAT_RGB;
    std::vector<unsigned char> rgb(PNG_IMAGE_SIZE(png));
    if (png_image_finish_read(&png, nullptr, rgb.data(), 0, nullptr) == 0) return false;
    width = static_cast<int>(png.width), height = static_cast<int>(png.height);
    for (std::size_t i = 0; i < rgb.size(); i += 3)
      pixels.push_back(
          static_cast<float>(0.299 * rgb[i] + 0.587 * rgb[i + 1] + 0.114 * rgb[i + 2]));
    return true;
  }
  float at(double x, double y) const {
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const float* p = &pixels[static_cast<std::size_t>(y0 * width + x0)];
    const float a = static_cast<float>(x - x0), b = static_cast<float>(y - y0);
    return (1 - a) * (1 - b) * p[0] + a * (1 - b) * p[1] + (1 - a) * b * p[width] +
           a * b * p[width + 1];
  }
};

using Residual = Eigen::Matrix<double, 16, 1>;

class PoseVertex final : public g2o::BaseVertex<6, Eigen::Isometry3d> {
 public:
  void setToOriginImpl() override { _estimate.setIdentity(); }
  void oplusImpl(const double* step) override {  // rho, phi
    const Eigen::Vector3d rho(step[0], step[1], step[2]), phi(step[3], step[4], step[5]);
    const double angle = phi.norm();
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity(), V = R, skew;
    skew << 0, -phi.z(), phi.y(), phi.z(), 0, -phi.x(), -phi.y(), phi.x(), 0;
    if (angle > 1e-9) {
      R = Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix();
      V += (1 - std::cos(angle)) / (angle * angle) * skew +
           (angle - std::sin(angle)) / (angle * angle * angle) * skew * skew;
    }
    Eigen::Isometry3d moved;
    moved.linear() = R * _estimate.linear();
    moved.translation() = R * _estimate.translation() + V * rho;
    moved.makeAffine();
    _estimate = moved;
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }
};

class PointVertex final : public g2o::BaseVertex<3, Eigen::Vector3d> {
 public:
  void setToOriginImpl() override { _estimate.setZero(); }
  void oplusImpl(const double* step) override { _estimate += Eigen::Vector3d::ConstMapType(step); }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }
};

class PatchEdge final : public g2o::BaseBinaryEdge<16, Residual, PoseVertex, PointVertex> {
 public:
  explicit PatchEdge(const Grey& image) : image_(image) {}

  void computeError() override {
    const Eigen::Vector3d P = pose() * point();
    const double u = fx * P.x() / P.z() + cx, v = fy * P.y() / P.z() + cy;
    outside_ = !(P.z() > 0 && u - 3 >= 0 && v - 3 >= 0 && u + 2 <= image_.width - 1 &&
                 v + 2 <= image_.height - 1);
    if (outside_) {
      _error.setZero();
      return;
    }
    int k = 0;
    for (int dx = -2; dx < 2; ++dx)
      for (int dy = -2; dy < 2; ++dy, ++k) _error[k] = _measurement[k] - image_.at(u + dx, v + dy);
  }

  void linearizeOplus() override {
    _jacobianOplusXi.setZero();
    _jacobianOplusXj.setZero();
    if (outside_) return;
    const Eigen::Vector3d P = pose() * point();
    const double X = P.x(), Y = P.y(), iz = 1 / P.z(), iz2 = iz * iz;
    const double u = fx * X * iz + cx, v = fy * Y * iz + cy;
    Eigen::Matrix<double, 2, 3> by_P;
    by_P << fx * iz, 0, -fx * X * iz2, 0, fy * iz, -fy * Y * iz2;
    Eigen::Matrix<double, 2, 6> by_pose;
    by_pose << fx * iz, 0, -fx * X * iz2, -fx * X * Y * iz2, fx + fx * X * X * iz2, -fx * Y * iz, 0,
        fy * iz, -fy * Y * iz2, -fy - fy * Y * Y * iz2, fy * X * Y * iz2, fy * X * iz;
    const Eigen::Matrix<double, 2, 3> by_point = by_P * pose().linear();
    int k = 0;
    for (int dx = -2; dx < 2; ++dx)
      for (int dy = -2; dy < 2; ++dy, ++k) {
        const double x = u + dx, y = v + dy;
        const Eigen::RowVector2d slope(0.5 * (image_.at(x + 1, y) - image_.at(x - 1, y)),
                                       0.5 * (image_.at(x, y + 1) - image_.at(x, y - 1)));
        _jacobianOplusXi.row(k) = -slope * by_pose;
        _jacobianOplusXj.row(k) = -slope * by_point;
      }
  }
  bool read(std::istream&) override { return false; }
  bool write(std::ostream&) const override { return false; }

 private:
  const Eigen::Isometry3d& pose() const {
    return static_cast<const PoseVertex*>(_vertices[0])->estimate();
  }
  const Eigen::Vector3d& point() const {
    return static_cast<const PointVertex*>(_vertices[1])->estimate();
  }
  const Grey& image_;
  bool outside_ = false;
};

bool build(const std::string& folder, std::vector<Grey>& images, g2o::SparseOptimizer& graph) {
  std::ifstream poses(folder + "/poses.txt"), points(folder + "/points.txt");
  double time, t[3], q[4];
  int id = 0;
  while (poses >> time >> t[0] >> t[1] >> t[2] >> q[0] >> q[1] >> q[2] >> q[3]) {
    auto* vertex = new PoseVertex;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized().toRotationMatrix();
    pose.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
    vertex->setEstimate(pose);
    vertex->setId(id);
    graph.addVertex(vertex);
    images.emplace_back();
    if (!images.back().read(folder + "/" + std::to_string(id) + ".png")) return false;
    ++id;
  }
  const int count = id;
  Eigen::Vector3d X;
  Residual patch;
  while (points >> X[0] >> X[1] >> X[2]) {
    for (int k = 0; k < 16; ++k) points >> patch[k];
    auto* vertex = new PointVertex;
    vertex->setEstimate(X);
    vertex->setId(id);
    vertex->setMarginalized(true);
    graph.addVertex(vertex);
    for (int j = 0; j < count; ++j) {
      auto* edge = new PatchEdge(images[static_cast<std::size_t>(j)]);
      edge->setVertex(0, graph.vertex(j));
      edge->setVertex(1, vertex);
      edge->setMeasurement(patch);
      edge->setInformation(Eigen::Matrix<double, 16, 16>::Identity());
      auto* kernel = new g2o::RobustKernelHuber;
      kernel->setDelta(1);
      edge->setRobustKernel(kernel);
      graph.addEdge(edge);
    }
    ++id;
  }
  return count > 0 && id > count;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) {
    std::fprintf(stderr, "peer-g2o-photometric FOLDER FX FY CX CY [ITERATIONS]\n");
    return 2;
  }
  fx = std::atof(argv[2]), fy = std::atof(argv[3]), cx = std::atof(argv[4]),
  cy = std::atof(argv[5]);
  const int iterations = argc > 6 ? std::atoi(argv[6]) : 35;
  using Blocks = g2o::BlockSolver<g2o::BlockSolverTraits<6, 3>>;
  g2o::SparseOptimizer graph;
  graph.setAlgorithm(new g2o::OptimizationAlgorithmLevenberg(std::make_unique<Blocks>(
      std::make_unique<g2o::LinearSolverEigen<Blocks::PoseMatrixType>>())));
  std::vector<Grey> images;
  images.reserve(10000);
  if (!build(argv[1], images, graph)) {
    std::fprintf(stderr, "%s: not such a folder\n", argv[1]);
    return 3;
  }
  graph.initializeOptimization();
  graph.computeActiveErrors();
  const double before = graph.activeRobustChi2(), plain = graph.activeChi2();
  const auto start = std::chrono::steady_clock::now();
  const int done = graph.optimize(iterations);
  const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  graph.computeActiveErrors();
  std::printf(
      "{\"iterations\": %d, \"seconds\": %.6f, \"seconds_per_iteration\": %.6f, \"plain_chi2\": "
      "%.9e, \"robust_chi2\": [%.9e, %.9e]}\n",
      done, s, s / done, plain, before, graph.activeRobustChi2());
}
