// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A matrix of known eigenvectors: what a run of conjugate gradients leaves to the next against
// these.
#include "reduced/recycled_modes.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <vector>

#include "platform/random.h"
#include "reduced/conjugate_gradients.h"

namespace sheaf {
namespace {

constexpr int kImages = 40, kColumns = 9 * kImages, kWeak = 5;

struct Identity {
  void solve(const double* r, double* z) const { std::copy_n(r, kColumns, z); }
};

/// Eigenvalues between 0.8 and 1.5, and kWeak small ones from 1e-4 up.
class RecycledModesTest : public testing::Test, public ImageOperator {
 protected:
  void SetUp() override {
    Random random(11);
    Eigen::MatrixXd Q(kColumns, kColumns);
    for (int i = 0; i < kColumns; ++i)
      for (int j = 0; j < kColumns; ++j) Q(i, j) = random.normal();
    vectors_ = Eigen::HouseholderQR<Eigen::MatrixXd>(Q).householderQ();
    values_.resize(kColumns);
    for (int i = 0; i < kColumns; ++i)
      values_[i] = i < kWeak ? 1e-4 * std::pow(3, i) : 0.8 + 0.7 * random.uniform();
    set_matrix(values_);
    b_.resize(kColumns);
    for (int i = 0; i < kColumns; ++i) b_[i] = random.normal();
    columns_.of_image.resize(kColumns);
    for (int i = 0; i < kColumns; ++i) columns_.of_image[static_cast<std::size_t>(i)] = i;
    columns_.count = kColumns;
  }
  void set_matrix(const Eigen::VectorXd& values) {
    S_ = vectors_ * values.asDiagonal() * vectors_.transpose();
  }
  void apply(const double* x, double* y) override {
    Eigen::VectorXd in(kColumns);
    for (int c = 0; c < kColumns; ++c) in[c] = x[kImageVector * std::size_t(c / 9) + c % 9];
    const Eigen::VectorXd out = S_ * in;
    for (int c = 0; c < kColumns; ++c) y[kImageVector * std::size_t(c / 9) + c % 9] = out[c];
  }
  /// Iterations; the solution is held against the exact one.
  int solve(ConjugateGradients& cg) {
    CameraVectors vectors;
    vectors.rhs.allocate(kColumns);
    Buffer<double> damping(kColumns), x(kColumns);
    for (int c = 0; c < kColumns; ++c) vectors.rhs[c] = b_[c], damping[c] = 0;
    CameraSystem system{};
    system.vectors = &vectors;
    system.damping = damping.data();
    system.forcing = 1e-12;
    const CameraSolution solution = cg.run(*this, Identity(), system, x);
    EXPECT_TRUE(solution.solved);
    const Eigen::VectorXd exact = S_.ldlt().solve(b_);
    const Eigen::VectorXd found = Eigen::Map<const Eigen::VectorXd>(x.data(), kColumns);
    EXPECT_LT((found - exact).norm(), 1e-4 * exact.norm());
    return solution.iterations;
  }
  /// Of conjugate gradients as in a textbook.
  RecycledModes after_a_run() const {
    RecycledModes modes(kColumns);
    Eigen::VectorXd r = b_, p = r;
    modes.begin();
    double rz = r.dot(r);
    for (int i = 0; i < 40; ++i) {
      const Eigen::VectorXd q = S_ * p;
      const double alpha = rz / p.dot(q);
      modes.add(r.data(), rz, alpha);
      r -= alpha * q;
      const double next = r.dot(r);
      p = r + next / rz * p;
      rz = next;
    }
    modes.end(rz);
    return modes;
  }

  Eigen::MatrixXd vectors_, S_;
  Eigen::VectorXd values_, b_;
  Columns columns_;
};

TEST_F(RecycledModesTest, MapsWeakDirectionsToOne) {
  const RecycledModes modes = after_a_run();
  ASSERT_EQ(modes.count(), std::size_t(kWeak));
  for (int i = 0; i < kWeak; ++i) {
    const Eigen::VectorXd e = vectors_.col(i), Se = S_ * e;
    Eigen::VectorXd z = Se;
    modes.correct(Se.data(), z.data());
    EXPECT_LT((z - e).norm(), 1e-2) << i;  // H S e = e
  }
  const Eigen::VectorXd strong = vectors_.col(kColumns - 1);
  Eigen::VectorXd z = strong;
  modes.correct(strong.data(), z.data());
  EXPECT_LT((z - strong).norm(), 1e-2);  // nothing is added to what was right
}

TEST_F(RecycledModesTest, SaveIterationsOfTheSystemsThatFollow) {
  ConjugateGradients cg(columns_);
  const int first = solve(cg);
  const int again = solve(cg);
  EXPECT_LT(2 * again, first);
  // The weak directions are twice as weak and the others change by a tenth.
  Eigen::VectorXd values = 1.1 * values_;
  values.head(kWeak) = 0.5 * values_.head(kWeak);
  set_matrix(values);
  EXPECT_LT(solve(cg), first - kWeak);
}

TEST_F(RecycledModesTest, AreAlwaysPositive) {
  // Of another matrix altogether: slower, but it gets there.
  ConjugateGradients cg(columns_);
  solve(cg);
  set_matrix(values_.reverse());
  solve(cg);
}

TEST_F(RecycledModesTest, ForgetWhenTold) {
  RecycledModes modes = after_a_run();
  const std::vector<double> ones(kColumns, 1.0);
  std::vector<double> z = ones;
  modes.correct(b_.data(), z.data());
  EXPECT_NE(z, ones);
  modes.clear();
  z = ones;
  modes.correct(b_.data(), z.data());
  EXPECT_EQ(z, ones);
}

}  // namespace
}  // namespace sheaf
