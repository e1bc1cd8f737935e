// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/implicit_solver.h"

#include <memory>

#include "reduced/block_diagonal.h"
#include "reduced/camera_solver.h"
#include "reduced/conjugate_gradients.h"
#include "reduced/preconditioner.h"
#include "systems/float_operator.h"
#include "systems/product_sums.h"

namespace sheaf {
namespace {

/// S x with Jacobians recomputed.
class ImplicitOperator : public ImageOperator {
 public:
  ImplicitOperator(const HeldState& state, const Kernels& kernels, ProductSums& sums)
      : state_(state), kernels_(kernels), sums_(sums) {}

  void apply(const double* x, double* y) override {
    const auto record = [&](std::size_t image) {
      return state_.cameras->data() + kCameraRecord * image;
    };
    for (std::size_t i = 0; i < sums_.num_images(); ++i)
      camera_record::write_step(record(i) + camera_record::kFocal, x + kImageVector * i,
                                record(i) + camera_record::kStep);
    const ProductInput in{state_.batches, state_.cameras->data(), state_.points->data(),
                          state_.factors->data(), state_.weights->data()};
    sums_.run([&](const Chunk& chunk, double* saved,
                  double* sums) { kernels_.product(in, chunk, saved, sums); },
              [&](std::size_t i, const double* total) {
                read_product(record(i) + camera_record::kFocal, total, y + kImageVector * i);
              });
  }

 private:
  HeldState state_;
  const Kernels& kernels_;
  ProductSums& sums_;
};

/// In mixed precision the operator is single until the system asks for double.
class ImplicitSolver : public CameraSolver {
 public:
  ImplicitSolver(const Columns& columns, const HeldState& state, bool mixed, const Kernels& kernels,
                 Threads& threads)
      : sums_(state, threads),
        operator_(state, kernels, sums_),
        blocks_(columns, threads),
        cg_(columns) {
    if (mixed) rounded_ = std::make_unique<FloatImplicitOperator>(columns, state, kernels, sums_);
  }

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    const bool round = rounded_ && !system.precise;
    if (round) rounded_->prepare(system.vectors->squares.data());
    ImageOperator& S = round ? static_cast<ImageOperator&>(*rounded_) : operator_;
    return cg_.run(S, Preconditioner{blocks_, system.coarse}, system, x);
  }
  CameraSolution shorten(const CameraSystem& system, Buffer<double>& x) override {
    return cg_.shorten(system, x);
  }
  std::uint64_t bytes() const override {
    return sums_.bytes() + (rounded_ ? rounded_->bytes() : 0) + blocks_.bytes() + cg_.bytes();
  }

 private:
  ProductSums sums_;  ///< of whichever operator runs
  ImplicitOperator operator_;
  std::unique_ptr<FloatImplicitOperator> rounded_;
  BlockDiagonal blocks_;
  ConjugateGradients cg_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_implicit_solver(const Columns& columns, const HeldState& state,
                                                   bool mixed, const Kernels& kernels,
                                                   Threads& threads) {
  return std::make_unique<ImplicitSolver>(columns, state, mixed, kernels, threads);
}

}  // namespace sheaf
