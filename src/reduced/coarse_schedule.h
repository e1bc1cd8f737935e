// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

namespace sheaf {

/// When the coarse matrix is summed anew. Its sums cost as much as six or seven products with S,
/// and what it mends, how clusters hang together, changes little from step to step: one that was
/// summed when the cost was much the same serves as well. Any E of any state keeps the
/// preconditioner positive definite, so nothing but iterations is at stake. Measured at 257 to 1778
/// images to 1e-3 of the best cost, single runs with tighter solves than today's: as many
/// iterations as with a new matrix at each step, and 9 to 23 % less time.
class CoarseSchedule {
 public:
  enum class Matrix { unneeded, kept, summed };

  /// For a step with this relative damping.
  Matrix next(double lambda) {
    matrix_ = Matrix::unneeded;
    if (lambda >= kEnoughDamping) return matrix_;
    const bool slower = first_iterations_ >= 0 && iterations_ > first_iterations_ + kMoreIterations;
    const bool far = !(cost_ >= kSameCost * summed_cost_ && cost_ <= summed_cost_);
    const bool weaker = lambda < kSameDamping * summed_lambda_;
    matrix_ = !summed_ || far || weaker || slower ? Matrix::summed : Matrix::kept;
    if (matrix_ == Matrix::summed) {
      summed_ = true;
      summed_cost_ = cost_;
      summed_lambda_ = lambda;
      first_iterations_ = -1;
    }
    return matrix_;
  }
  /// What the last step was told.
  Matrix matrix() const { return matrix_; }
  /// What the step's solve took.
  void solved(int iterations) {
    if (matrix_ == Matrix::unneeded) return;
    iterations_ = iterations;
    if (first_iterations_ < 0) first_iterations_ = iterations;
  }
  /// The cost of the state that a step went to.
  void moved(double cost) { cost_ = cost; }

  template <class Archive>
  void fields(Archive& a) {
    a(matrix_, summed_, cost_, summed_cost_, summed_lambda_, iterations_, first_iterations_);
  }

 private:
  /// (S + D) scaled to a unit diagonal has no eigenvalue below this, so that the first part of the
  /// preconditioner is enough: the first step from afar needs as many iterations without E.
  static constexpr double kEnoughDamping = 5e-3;
  /// The weaker the damping, the weaker the modes that E must know.
  static constexpr double kSameCost = 0.8, kSameDamping = 1e-2;
  static constexpr int kMoreIterations = 7;

  Matrix matrix_ = Matrix::unneeded;
  bool summed_ = false;
  double cost_ = std::numeric_limits<double>::infinity(), summed_cost_ = 0, summed_lambda_ = 0;
  int iterations_ = 0, first_iterations_ = -1;
};

}  // namespace sheaf
