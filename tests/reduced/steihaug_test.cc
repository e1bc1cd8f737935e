// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Conjugate gradients within a radius against the exact minimum of the model there, found from the
// eigenvalues of the dense matrix.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "platform/random.h"
#include "reduced/conjugate_gradients.h"

namespace sheaf {
namespace {

constexpr int kImages = 4, kColumns = 9 * kImages;
constexpr double kLambda = 1e-3;

struct DenseOperator : ImageOperator {
  Eigen::MatrixXd S;
  void apply(const double* x, double* y) override {
    Eigen::VectorXd in(kColumns);
    for (int c = 0; c < kColumns; ++c) in[c] = x[kImageVector * (c / 9) + c % 9];
    const Eigen::VectorXd out = S * in;
    for (int c = 0; c < kColumns; ++c) y[kImageVector * (c / 9) + c % 9] = out[c];
  }
};

/// M = C: then the length |x|_C of the iterates grows from one to the next.
struct ScalingOnly {
  Eigen::VectorXd C;
  void solve(const double* r, double* z) const {
    for (int c = 0; c < kColumns; ++c) z[c] = r[c] / C[c];
  }
};

class Steihaug : public testing::Test {
 protected:
  /// Curvatures from 1 to 1e-6 of the columns' own, and `negative` of them turned around.
  void make(int negative) {
    Random random(7);
    Eigen::MatrixXd Q(kColumns, kColumns);
    for (int i = 0; i < kColumns; ++i)
      for (int j = 0; j < kColumns; ++j) Q(i, j) = random.normal();
    Q = Eigen::HouseholderQR<Eigen::MatrixXd>(Q).householderQ();
    Eigen::VectorXd e(kColumns);
    for (int i = 0; i < kColumns; ++i)
      e[i] = std::pow(10, -6.0 * i / kColumns) * (i < negative ? -1 : 1);
    C_.resize(kColumns);
    for (int i = 0; i < kColumns; ++i) C_[i] = std::pow(10, 4 * random.uniform() - 2);
    scaled_ = Q * e.asDiagonal() * Q.transpose() + kLambda * Eigen::MatrixXd::Identity(36, 36);
    const Eigen::VectorXd root = C_.cwiseSqrt();
    A_ = root.asDiagonal() * scaled_ * root.asDiagonal();
    operator_.S = A_ - kLambda * Eigen::MatrixXd(C_.asDiagonal());
    b_.resize(kColumns);
    for (int i = 0; i < kColumns; ++i) b_[i] = random.normal() * root[i];
    columns_.of_image.resize(kColumns);
    std::iota(columns_.of_image.begin(), columns_.of_image.end(), 0);
    columns_.count = kColumns;
  }

  /// Within the radius; or, shortened to it from a larger one.
  Eigen::VectorXd solve(double radius, double from = 0) {
    ConjugateGradients cg(columns_);
    CameraVectors vectors;
    vectors.rhs.allocate(40), vectors.rhs.fill(0);
    Buffer<double> damping(40), x(40);
    for (int c = 0; c < kColumns; ++c) vectors.rhs[c] = b_[c], damping[c] = kLambda * C_[c];
    CameraSystem system{};
    system.vectors = &vectors;
    system.damping = damping.data();
    system.forcing = 1e-15;
    system.radius = from > 0 ? from : radius;
    system.lambda = kLambda;
    system.dogleg = true;
    solution_ = cg.run(operator_, ScalingOnly{C_}, system, x);
    if (from > 0) {
      system.radius = radius;
      solution_ = cg.shorten(system, x);
      if (!solution_.solved) return Eigen::VectorXd::Zero(kColumns);
    }
    const Eigen::VectorXd out = Eigen::Map<const Eigen::VectorXd>(x.data(), kColumns);
    residual_error_ = 0;
    const Eigen::VectorXd q = b_ - A_ * out;
    for (int c = 0; c < kColumns; ++c)
      residual_error_ = std::max(residual_error_, std::abs(solution_.residual[c] - q[c]));
    return out;
  }

  double decrease(const Eigen::VectorXd& x) const { return b_.dot(x) - x.dot(A_ * x) / 2; }
  double length(const Eigen::VectorXd& x) const { return std::sqrt(x.dot(C_.asDiagonal() * x)); }

  /// The largest decrease within the radius: (A + sigma C) x = b with the least sigma >= 0 that
  /// keeps A + sigma C positive and |x|_C <= radius.
  double best(double radius) const {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled_);
    const Eigen::VectorXd g =
        eigen.eigenvectors().transpose() * b_.cwiseQuotient(C_.cwiseSqrt()).eval();
    const Eigen::VectorXd& e = eigen.eigenvalues();
    const auto at = [&](double sigma) {
      return g.cwiseQuotient((e.array() + sigma).matrix()).eval();
    };
    double low = std::max(0.0, -e.minCoeff()) * (1 + 1e-12), high = low + g.norm() / radius + 1;
    if (low == 0 && at(0).norm() <= radius) high = 0;
    for (int i = 0; i < 200 && high > 0; ++i) {
      const double middle = (low + high) / 2;
      (at(middle).norm() > radius ? low : high) = middle;
    }
    const Eigen::VectorXd y = at(high);
    return g.dot(y) - y.dot(e.asDiagonal() * y) / 2;
  }

  Eigen::MatrixXd A_, scaled_;
  Eigen::VectorXd C_, b_;
  DenseOperator operator_;
  Columns columns_;
  CameraSolution solution_;
  double residual_error_ = 0;
};

// Half of the best decrease is what a truncated solve owes where the model is convex (Yuan, On the
// truncated conjugate gradient method, 2000).
TEST_F(Steihaug, GainsAtLeastHalfOfWhatTheRadiusAllows) {
  make(0);
  const Eigen::VectorXd whole = solve(1e30);
  EXPECT_FALSE(solution_.cut);
  EXPECT_NEAR(decrease(whole), decrease(A_.ldlt().solve(b_)), 1e-9 * decrease(whole));
  double last = decrease(whole);
  for (double share : {0.99, 0.5, 0.2, 0.05, 1e-2, 1e-3, 1e-5}) {
    const double radius = share * length(whole);
    const Eigen::VectorXd x = solve(radius);
    EXPECT_TRUE(solution_.solved && solution_.cut);
    EXPECT_NEAR(length(x), radius, 1e-12 * radius);
    EXPECT_LE(decrease(x), best(radius) * (1 + 1e-9));
    EXPECT_GE(decrease(x), 0.5 * best(radius)) << share;
    EXPECT_LE(decrease(x), last);
    EXPECT_LT(residual_error_, 1e-10 * b_.norm());
    last = decrease(x);
  }
  // At last the first direction alone is left, and nothing is better within so small a radius.
  EXPECT_EQ(solution_.iterations, 1);
  EXPECT_NEAR(last, best(1e-5 * length(whole)), 1e-3 * last);
}

// Few iterates: the path that is kept is the one that was taken.
TEST_F(Steihaug, AShorterPathIsThePathOfASmallerRadius) {
  make(0);
  const double whole = length(solve(1e30));
  const double far = 0.02 * whole;
  solve(far);
  ASSERT_LT(solution_.iterations, 16);
  for (double share : {0.9, 0.5, 0.1, 0.01}) {
    const Eigen::VectorXd expected = solve(share * far);
    const Eigen::VectorXd x = solve(share * far, far);
    ASSERT_TRUE(solution_.solved && solution_.cut);
    EXPECT_EQ(solution_.iterations, 0);
    EXPECT_LT(length(x - expected), 1e-9 * share * far);
    EXPECT_LT(residual_error_, 1e-10 * b_.norm());
  }
  solve(2 * far, far);
  EXPECT_FALSE(solution_.solved);  // it ends before
}

// Of many iterates some are forgotten: between those left the path is a chord, still within reach
// of the best.
TEST_F(Steihaug, ALongPathIsKeptInPart) {
  make(0);
  const Eigen::VectorXd whole = solve(1e30);
  ASSERT_GT(solution_.iterations, 30);
  double last = decrease(whole);
  for (double share : {0.9, 0.5, 0.2, 0.05, 1e-2, 1e-3}) {
    const double radius = share * length(whole);
    const Eigen::VectorXd x = solve(radius, 1e30);
    ASSERT_TRUE(solution_.solved);
    EXPECT_NEAR(length(x), radius, 1e-10 * radius);
    EXPECT_LT(decrease(x), last);
    EXPECT_GE(decrease(x), 0.5 * best(radius)) << share;
    EXPECT_LT(residual_error_, 1e-10 * b_.norm());
    last = decrease(x);
  }
}

TEST_F(Steihaug, GoesToTheBoundaryWhereThereIsNoCurvature) {
  make(3);
  for (double radius : {1e-3, 0.1, 1.0, 100.0}) {
    const Eigen::VectorXd x = solve(radius);
    EXPECT_TRUE(solution_.solved && solution_.cut);
    EXPECT_NEAR(length(x), radius, 1e-10 * radius);
    const Eigen::VectorXd descent = b_.cwiseQuotient(C_);
    const double steepest = decrease(descent * (radius / length(descent)));
    EXPECT_GE(decrease(x), steepest * (1 - 1e-9));
    EXPECT_LE(decrease(x), best(radius) * (1 + 1e-9));
  }
}

// Without a radius the solve ends there, with what it has.
TEST_F(Steihaug, WithoutARadiusStopsWhereThereIsNoCurvature) {
  make(3);
  solve(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(solution_.cut);
}

}  // namespace
}  // namespace sheaf
