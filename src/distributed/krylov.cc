// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/krylov.h"

#include <petsc/private/vecimpl.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "distributed/petsc_check.h"

namespace sheaf {
namespace {

constexpr int kMostIterations = 500, kLeastIterations = 4;

/// In eight chains, so that the sum has one order on every machine.
double dot_of(const double* a, const double* b, std::size_t n) {
  double lanes[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8)
    for (std::size_t l = 0; l < 8; ++l) lanes[l] += a[i + l] * b[i + l];
  for (std::size_t l = 0; i < n; ++i, ++l) lanes[l] += a[i] * b[i];
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

// PETSc's own sums follow the number of ranks: vectors know the Krylov that they are of, which sums
// by piece.
PetscErrorCode owner_of(Vec x, const Krylov** out) {
  PetscContainer container = nullptr;
  PetscFunctionBeginUser;
  PetscCall(PetscObjectQuery(reinterpret_cast<PetscObject>(x), "krylov",
                             reinterpret_cast<PetscObject*>(&container)));
  PetscCall(
      PetscContainerGetPointer(container, reinterpret_cast<void**>(const_cast<Krylov**>(out))));
  PetscFunctionReturn(0);
}

PetscErrorCode dots_by_piece(Vec x, PetscInt n, const Vec y[], PetscScalar* out) {
  const Krylov* owner = nullptr;
  const double* a = nullptr;
  PetscFunctionBeginUser;
  PetscCall(owner_of(x, &owner));
  PetscCall(VecGetArrayRead(x, &a));
  std::vector<const double*> b(static_cast<std::size_t>(n));
  for (PetscInt k = 0; k < n; ++k)
    PetscCall(VecGetArrayRead(y[k], &b[static_cast<std::size_t>(k)]));
  const std::vector<double> sums = owner->dots(a, b);
  std::copy(sums.begin(), sums.end(), out);
  for (PetscInt k = 0; k < n; ++k)
    PetscCall(VecRestoreArrayRead(y[k], &b[static_cast<std::size_t>(k)]));
  PetscCall(VecRestoreArrayRead(x, &a));
  PetscFunctionReturn(0);
}
PetscErrorCode dot_by_piece(Vec x, Vec y, PetscScalar* out) { return dots_by_piece(x, 1, &y, out); }
PetscErrorCode norm_by_piece(Vec x, NormType type, PetscReal* out) {
  PetscFunctionBeginUser;
  if (type != NORM_2 && type != NORM_FROBENIUS)
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_SUP, "only the 2-norm is summed by pieces");
  PetscCall(dots_by_piece(x, 1, &x, out));
  *out = std::sqrt(*out);
  PetscFunctionReturn(0);
}

/// Duplicates keep the sums.
PetscErrorCode duplicate_by_piece(Vec x, Vec* out);
void sum_by_piece(Vec x) {
  x->ops->dot = x->ops->tdot = dot_by_piece;
  x->ops->mdot = x->ops->mtdot = dots_by_piece;
  x->ops->norm = norm_by_piece;
  x->ops->duplicate = duplicate_by_piece;
}
PetscErrorCode duplicate_by_piece(Vec x, Vec* out) {
  PetscObject owner = nullptr;
  PetscInt local = 0;
  PetscFunctionBeginUser;
  PetscCall(VecGetLocalSize(x, &local));
  PetscCall(
      VecCreateMPI(PetscObjectComm(reinterpret_cast<PetscObject>(x)), local, PETSC_DETERMINE, out));
  PetscCall(PetscObjectQuery(reinterpret_cast<PetscObject>(x), "krylov", &owner));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(*out), "krylov", owner));
  sum_by_piece(*out);
  PetscFunctionReturn(0);
}

template <class Call>
PetscErrorCode on_arrays(Vec from, Vec to, const Call& call) {
  const double* x = nullptr;
  double* y = nullptr;
  PetscFunctionBeginUser;
  PetscCall(VecGetArrayRead(from, &x));
  PetscCall(VecGetArrayWrite(to, &y));
  call(x, y);
  PetscCall(VecRestoreArrayRead(from, &x));
  PetscCall(VecRestoreArrayWrite(to, &y));
  PetscFunctionReturn(0);
}

}  // namespace

Krylov::Krylov(const Ranks& ranks, std::vector<std::size_t> begins, Apply multiply,
               Apply precondition)
    : ranks_(ranks),
      begins_(std::move(begins)),
      multiply_(std::move(multiply)),
      precondition_(std::move(precondition)) {
  make_vectors();
  make_solver();
}

Krylov::~Krylov() {
  KSPDestroy(&ksp_);
  MatDestroy(&S_);
  VecDestroy(&x_);
  VecDestroy(&b_);
}

void Krylov::make_vectors() {
  petsc_check(VecCreateMPI(ranks_.comm(), static_cast<PetscInt>(size()), PETSC_DETERMINE, &x_));
  PetscContainer container = nullptr;
  petsc_check(PetscContainerCreate(ranks_.comm(), &container));
  petsc_check(PetscContainerSetPointer(container, this));
  petsc_check(PetscObjectCompose(reinterpret_cast<PetscObject>(x_), "krylov",
                                 reinterpret_cast<PetscObject>(container)));
  petsc_check(PetscContainerDestroy(&container));
  sum_by_piece(x_);
  petsc_check(VecDuplicate(x_, &b_));
}

void Krylov::make_solver() {
  const auto n = static_cast<PetscInt>(size());
  petsc_check(MatCreateShell(ranks_.comm(), n, n, PETSC_DETERMINE, PETSC_DETERMINE, this, &S_));
  const auto mult = +[](Mat A, Vec x, Vec y) -> PetscErrorCode {
    Krylov* me = nullptr;
    PetscFunctionBeginUser;
    PetscCall(MatShellGetContext(A, &me));
    PetscCall(on_arrays(x, y, me->multiply_));
    PetscFunctionReturn(0);
  };
  petsc_check(MatShellSetOperation(S_, MATOP_MULT, reinterpret_cast<void (*)()>(mult)));
  petsc_check(MatShellSetVecType(S_, VECMPI));
  petsc_check(MatSetOption(S_, MAT_SYMMETRIC, PETSC_TRUE));
  petsc_check(MatSetOption(S_, MAT_SPD, PETSC_TRUE));
  petsc_check(KSPCreate(ranks_.comm(), &ksp_));
  petsc_check(KSPSetOperators(ksp_, S_, S_));
  petsc_check(KSPSetType(ksp_, KSPCG));
  petsc_check(KSPSetNormType(ksp_, KSP_NORM_NATURAL));
  petsc_check(KSPSetTolerances(ksp_, 1e-14, 0, PETSC_DEFAULT, kMostIterations));
  PC pc = nullptr;
  petsc_check(KSPGetPC(ksp_, &pc));
  petsc_check(PCSetType(pc, PCSHELL));
  petsc_check(PCShellSetContext(pc, this));
  petsc_check(PCShellSetApply(pc, [](PC shell, Vec r, Vec z) -> PetscErrorCode {
    Krylov* me = nullptr;
    PetscFunctionBeginUser;
    PetscCall(PCShellGetContext(shell, &me));
    PetscCall(on_arrays(r, z, me->precondition_));
    PetscFunctionReturn(0);
  }));
  petsc_check(KSPSetFromOptions(ksp_));
  petsc_check(KSPSetConvergenceTest(
      ksp_,
      [](KSP, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason,
         void* context) -> PetscErrorCode {
        return static_cast<Krylov*>(context)->test(iteration, norm, reason);
      },
      this, nullptr));
}

/// The solution is a sum of directions that the residual is orthogonal to: the model falls by half
/// of x . b.
PetscErrorCode Krylov::test(PetscInt iteration, PetscReal norm, KSPConvergedReason* reason) {
  PetscFunctionBeginUser;
  *reason = KSP_CONVERGED_ITERATING;
  if (!std::isfinite(norm)) {
    *reason = KSP_DIVERGED_NANORINF;
    PetscFunctionReturn(0);
  }
  if (iteration == 0) {
    first_norm_ = norm;
    model_ = 0;
    if (!(norm > 0)) *reason = KSP_CONVERGED_ATOL;
    PetscFunctionReturn(0);
  }
  if (cancelled_ && cancelled_()) {
    stopped_ = true;
    *reason = KSP_DIVERGED_BREAKDOWN;
    PetscFunctionReturn(0);
  }
  Vec x = nullptr;
  PetscScalar d = 0;
  PetscCall(KSPBuildSolution(ksp_, nullptr, &x));
  PetscCall(VecDot(x, b_, &d));
  const double before = model_;
  model_ = d / 2;
  const bool small = iteration >= kLeastIterations &&
                     static_cast<double>(iteration) * (model_ - before) < forcing_ * model_;
  if (small || norm <= 1e-14 * first_norm_) *reason = KSP_CONVERGED_RTOL;
  PetscFunctionReturn(0);
}

Krylov::Solution Krylov::solve(const double* b, double forcing,
                               const std::function<bool()>& cancelled, double* x) {
  forcing_ = forcing;
  cancelled_ = cancelled;
  stopped_ = false;
  double* to = nullptr;
  petsc_check(VecGetArrayWrite(b_, &to));
  std::copy_n(b, size(), to);
  petsc_check(VecRestoreArrayWrite(b_, &to));
  petsc_check(KSPSolve(ksp_, b_, x_));
  PetscInt iterations = 0;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  petsc_check(KSPGetIterationNumber(ksp_, &iterations));
  petsc_check(KSPGetConvergedReason(ksp_, &reason));
  const double* from = nullptr;
  petsc_check(VecGetArrayRead(x_, &from));
  std::copy_n(from, size(), x);
  petsc_check(VecRestoreArrayRead(x_, &from));
  const double length2 = dots(x, {x})[0];
  return {!stopped_ && std::isfinite(length2) && (reason > 0 || reason == KSP_DIVERGED_ITS),
          static_cast<int>(iterations)};
}

std::vector<double> Krylov::dots(const double* a, const std::vector<const double*>& b) const {
  std::vector<double> mine;
  for (std::size_t p = 0; p + 1 < begins_.size(); ++p)
    for (const double* v : b)
      mine.push_back(dot_of(a + begins_[p], v + begins_[p], begins_[p + 1] - begins_[p]));
  return ranks_.sum(b.size(), mine);
}

}  // namespace sheaf
