// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What it costs to leave the lens distortion's own derivatives out of the Jacobian, as many course
// solutions do: a plain Levenberg-Marquardt loop, points eliminated, once with the exact Jacobian
// and once with the distortion factor d(n) held constant while P is differentiated. The residual is
// the same in both: only the way there differs.
//   bench-frozen FILE [TOLERANCE [STEPS]]
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "geometry/rigid_motion.h"
#include "sheaf/sheaf.h"

namespace {

using namespace sheaf;
using Camera9 = Eigen::Matrix<double, 9, 1>;
using Block9 = Eigen::Matrix<double, 9, 9>;
using Coupling = Eigen::Matrix<double, 9, 3>;

/// Which derivatives are taken and what is free.
struct Variant {
  bool frozen, points_free;
};

struct Row {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 9> by_camera;
  Eigen::Matrix<double, 2, 3> by_point;
};

/// docs/math.md has the exact formulas; frozen: A = f d (-1/P.z) [I | p] without the term in p p^T.
Row linearize(const Problem& problem, std::size_t i, bool frozen) {
  const std::uint32_t image = problem.observation_image[i];
  const auto& lens = problem.cameras[problem.image_camera[image]].parameters;
  const double f = lens[0], k1 = lens[1], k2 = lens[2];
  const Matrix3<double> rotation = matrix_from_quaternion(problem.poses[image].rotation);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(rotation.data());
  const Eigen::Map<const Eigen::Vector3d> t(problem.poses[image].translation.data()),
      X(&problem.points[3 * std::size_t(problem.observation_point[i])]);
  const Eigen::Vector3d P = R * X + t;
  const Eigen::Vector2d p = -P.head<2>() / P.z();
  const double n = p.squaredNorm(), d = 1 + n * (k1 + k2 * n);
  Eigen::Matrix2d by_p = f * d * Eigen::Matrix2d::Identity();
  if (!frozen) by_p += f * (2 * k1 + 4 * k2 * n) * p * p.transpose();
  Eigen::Matrix<double, 2, 3> p_by_P;
  p_by_P << Eigen::Matrix2d::Identity(), p;
  const Eigen::Matrix<double, 2, 3> A = -by_p * p_by_P / P.z();
  Eigen::Matrix3d cross;
  cross << 0, -P.z(), P.y(), P.z(), 0, -P.x(), -P.y(), P.x(), 0;
  Row row;
  row.r =
      f * d * p - Eigen::Vector2d(problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]);
  row.by_camera << A, -A * cross, d * p, f * n * p, f * n * n * p;
  row.by_point = A * R;
  return row;
}

double cost_of(const Problem& problem) { return evaluate(problem).cost; }

/// Marquardt's: (1 + lambda) on the diagonal.
template <class Matrix>
Matrix damped(Matrix A, double lambda) {
  A.diagonal() *= 1 + lambda;
  return A;
}

/// The normal equations, and their solution for one damping.
class Equations {
 public:
  Equations(const Problem& problem, Variant variant) : problem_(problem), variant_(variant) {
    U_.assign(problem.num_images(), Block9::Zero());
    b_.assign(problem.num_images(), Camera9::Zero());
    V_.assign(problem.num_points(), Eigen::Matrix3d::Zero());
    g_.assign(problem.num_points(), Eigen::Vector3d::Zero());
    W_.resize(problem.num_observations());
    of_point_.resize(problem.num_points());
    for (std::size_t i = 0; i < problem.num_observations(); ++i) {
      const Row row = linearize(problem, i, variant.frozen);
      const std::uint32_t c = problem.observation_image[i], j = problem.observation_point[i];
      U_[c] += row.by_camera.transpose() * row.by_camera;
      b_[c] -= row.by_camera.transpose() * row.r;
      V_[j] += row.by_point.transpose() * row.by_point;
      g_[j] -= row.by_point.transpose() * row.r;
      W_[i] = row.by_camera.transpose() * row.by_point;
      of_point_[j].push_back(i);
    }
  }

  /// Steps of cameras and points; false when the matrix is not positive definite.
  bool solve(double lambda, std::vector<Camera9>& cameras, std::vector<Eigen::Vector3d>& points) {
    const std::size_t images = U_.size();
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(9 * images, 9 * images);
    Eigen::VectorXd b(9 * images);
    for (std::size_t c = 0; c < images; ++c) {
      S.block<9, 9>(9 * c, 9 * c) = damped(U_[c], lambda);
      b.segment<9>(9 * c) = b_[c];
    }
    if (variant_.points_free) eliminate(lambda, S, b);
    const Eigen::LLT<Eigen::MatrixXd> factor(S);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::VectorXd x = factor.solve(b);
    cameras.resize(images);
    for (std::size_t c = 0; c < images; ++c) cameras[c] = x.segment<9>(9 * c);
    points.assign(V_.size(), Eigen::Vector3d::Zero());
    for (std::size_t j = 0; variant_.points_free && j < V_.size(); ++j) {
      Eigen::Vector3d s = g_[j];
      for (std::size_t i : of_point_[j])
        s -= W_[i].transpose() * cameras[problem_.observation_image[i]];
      points[j] = damped(V_[j], lambda).llt().solve(s);
    }
    return true;
  }

 private:
  void eliminate(double lambda, Eigen::MatrixXd& S, Eigen::VectorXd& b) const {
    for (std::size_t j = 0; j < V_.size(); ++j) {
      const Eigen::Matrix3d inverse = damped(V_[j], lambda).inverse();
      for (std::size_t i : of_point_[j]) {
        const std::uint32_t c = problem_.observation_image[i];
        const Coupling Y = W_[i] * inverse;
        b.segment<9>(9 * c) -= Y * g_[j];
        for (std::size_t k : of_point_[j])
          S.block<9, 9>(9 * c, 9 * problem_.observation_image[k]) -= Y * W_[k].transpose();
      }
    }
  }

  const Problem& problem_;
  Variant variant_;
  std::vector<Block9> U_;
  std::vector<Camera9> b_;
  std::vector<Eigen::Matrix3d> V_;
  std::vector<Eigen::Vector3d> g_;
  std::vector<Coupling> W_;
  std::vector<std::vector<std::size_t>> of_point_;
};

Problem stepped(const Problem& from, const std::vector<Camera9>& cameras,
                const std::vector<Eigen::Vector3d>& points) {
  Problem to = from;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const Camera9& s = cameras[c];
    const RigidMotion<double> pose =
        left_perturbed<double>({from.poses[c].rotation, from.poses[c].translation},
                               {s[0], s[1], s[2]}, {s[3], s[4], s[5]});
    to.poses[c] = {pose.rotation, pose.translation};
    for (int k = 0; k < 3; ++k) to.cameras[to.image_camera[c]].parameters[k] += s[6 + k];
  }
  for (std::size_t j = 0; j < points.size(); ++j)
    for (int k = 0; k < 3; ++k) to.points[3 * j + k] += points[j][k];
  return to;
}

/// Levenberg-Marquardt with a damping that falls by 3 and rises by 2, 4, 8, ...; ends like the
/// engine: two accepted steps in a row below the tolerance, or a damping beyond any use.
void run(Problem problem, Variant variant, double tolerance, int most) {
  const double begin = cost_of(problem);
  double cost = begin, lambda = 1e-4, growth = 2;
  int accepted = 0, rejected = 0, still = 0, percent = -1;
  std::vector<double> costs;
  while (accepted + rejected < most && still < 2 && lambda < 1e12) {
    Equations equations(problem, variant);
    std::vector<Camera9> cameras;
    std::vector<Eigen::Vector3d> points;
    for (bool again = true; again && accepted + rejected < most && lambda < 1e12;) {
      Problem trial = problem;
      double tried = HUGE_VAL;
      if (equations.solve(lambda, cameras, points)) {
        trial = stepped(problem, cameras, points);
        tried = cost_of(trial);
      }
      again = !(tried < cost);
      if (again) {
        ++rejected;
        lambda *= growth;
        growth *= 2;
        continue;
      }
      ++accepted;
      still = cost - tried <= tolerance * cost ? still + 1 : 0;
      problem = trial;
      cost = tried;
      lambda = std::max(lambda / 3, 1e-12);
      growth = 2;
    }
    costs.push_back(cost);
  }
  for (std::size_t k = 0; k < costs.size() && percent < 0; ++k)
    if (costs[k] <= 1.01 * cost) percent = static_cast<int>(k) + 1;
  std::printf("| %s | %s | %d | %d | %d | %.8g | %.8g |\n",
              variant.points_free ? "poses, lenses, points" : "poses, lenses",
              variant.frozen ? "d(n) held constant" : "exact", accepted, rejected, percent,
              2 * begin, 2 * cost);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s FILE [TOLERANCE [STEPS]]\n", argv[0]);
    return 2;
  }
  Result<Problem> problem = read(argv[1]);
  if (!problem.ok()) {
    std::fprintf(stderr, "%s\n", problem.error().what());
    return 3;
  }
  const double tolerance = argc > 2 ? std::atof(argv[2]) : 1e-9;
  const int most = argc > 3 ? std::atoi(argv[3]) : 200;
  std::printf(
      "| free | Jacobian | accepted | rejected | accepted to 1%% | chi2, start | chi2, end |\n"
      "|---|---|--:|--:|--:|--:|--:|\n");
  for (bool points_free : {false, true})
    for (bool frozen : {false, true}) run(problem.value(), {frozen, points_free}, tolerance, most);
}
