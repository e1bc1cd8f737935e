// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <petscksp.h>

#include <cstddef>
#include <functional>
#include <vector>

#include "distributed/ranks.h"

namespace sheaf {

/// PETSc's conjugate gradients over vectors that lie with their owners. Its stopping rule is
/// ConjugateGradients' own: where an iteration's part of the model's decrease falls below `forcing`
/// of the mean part so far. All else is PETSc's to be told by options and to report: -ksp_type,
/// -ksp_monitor, -log_view.
class Krylov {
 public:
  /// y = S x + D x, z = M^-1 r: of this rank's part of the vectors.
  using Apply = std::function<void(const double*, double*)>;

  /// begins: where each of this rank's pieces begins in its part of the vectors, and their end.
  Krylov(const Ranks& ranks, std::vector<std::size_t> begins, Apply multiply, Apply precondition);
  ~Krylov();
  Krylov(const Krylov&) = delete;
  Krylov& operator=(const Krylov&) = delete;

  struct Solution {
    bool solved = false;
    int iterations = 0;
  };
  /// cancelled: asked by every rank alike at each iteration; or null.
  Solution solve(const double* b, double forcing, const std::function<bool()>& cancelled,
                 double* x);
  /// a . b for each b, summed piece by piece in their order: the vectors' own dot products.
  std::vector<double> dots(const double* a, const std::vector<const double*>& b) const;

 private:
  void make_vectors();
  void make_solver();
  PetscErrorCode test(PetscInt iteration, PetscReal norm, KSPConvergedReason* reason);
  std::size_t size() const { return begins_.back(); }

  const Ranks& ranks_;
  const std::vector<std::size_t> begins_;
  Apply multiply_, precondition_;
  Vec x_ = nullptr, b_ = nullptr;
  Mat S_ = nullptr;
  KSP ksp_ = nullptr;
  double forcing_ = 0.1, model_ = 0, first_norm_ = 0;
  std::function<bool()> cancelled_;
  bool stopped_ = false;
};

}  // namespace sheaf
