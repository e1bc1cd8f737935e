// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/implicit_solver.h"

#include <utility>

#include "reduced/block_diagonal.h"
#include "reduced/preconditioner.h"

namespace sheaf {
namespace {

class ImplicitSolver : public CameraSolver {
 public:
  ImplicitSolver(const Columns& columns, std::unique_ptr<StateOperator> exact,
                 std::unique_ptr<StateOperator> rounded, Threads& threads)
      : exact_(std::move(exact)),
        rounded_(std::move(rounded)),
        blocks_(columns, threads),
        cg_(columns) {}

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    StateOperator& S = rounded_ && !system.precise ? *rounded_ : *exact_;
    S.prepare(system.vectors->squares.data());
    return cg_.run(S, Preconditioner{blocks_, system.coarse}, system, x);
  }
  CameraSolution shorten(const CameraSystem& system, Buffer<double>& x) override {
    return cg_.shorten(system, x);
  }
  RecycledModes::History history() const override { return cg_.history(); }
  bool restore(const RecycledModes::History& history) override { return cg_.restore(history); }
  std::uint64_t bytes() const override {
    return exact_->bytes() + (rounded_ ? rounded_->bytes() : 0) + blocks_.bytes() + cg_.bytes();
  }

 private:
  std::unique_ptr<StateOperator> exact_, rounded_;
  BlockDiagonal blocks_;
  ConjugateGradients cg_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_implicit_solver(const Columns& columns,
                                                   std::unique_ptr<StateOperator> exact,
                                                   std::unique_ptr<StateOperator> rounded,
                                                   Threads& threads) {
  return std::make_unique<ImplicitSolver>(columns, std::move(exact), std::move(rounded), threads);
}

}  // namespace sheaf
