// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <memory>
#include <vector>

#include "linear/block_diagonal.h"
#include "linear/camera_solver.h"
#include "linear/conjugate_gradients.h"
#include "linear/float_operator.h"
#include "linear/preconditioner.h"

namespace sheaf {
namespace {

/// S x with Jacobians recomputed. Slices of chunks sum apart and are added in order.
class ImplicitOperator : public ImageOperator {
 public:
  ImplicitOperator(const HeldState& state, const Kernels& kernels, Threads& threads)
      : state_(state), kernels_(kernels), threads_(threads), saved_(threads.count()) {
    images_ = state.cameras->size() / kCameraRecord;
    slices_ = state.chunks->slices.size() - 1;
    sums_.allocate(slices_ * kProductRecord * images_);
  }

  void apply(const double* x, double* y) override {
    for (std::size_t i = 0; i < images_; ++i) write_step(x + kImageVector * i, i);
    const ProductInput in{state_.batches, state_.cameras->data(), state_.points->data(),
                          state_.factors->data(), state_.weights->data()};
    const std::size_t stride = kProductRecord * images_;
    threads_.for_each(slices_, [&](std::size_t s) {
      Buffer<double>& saved = saved_[threads_.worker()];
      if (saved.size() == 0) saved.allocate(product_scratch_doubles(*state_.batches));
      double* sums = &sums_[s * stride];
      std::fill_n(sums, stride, 0.0);
      const auto& slices = state_.chunks->slices;
      for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
        kernels_.product(in, state_.chunks->chunks[c], saved.data(), sums);
    });
    constexpr std::size_t kImagesPerTask = 1024;
    threads_.for_each((images_ + kImagesPerTask - 1) / kImagesPerTask, [&](std::size_t t) {
      const std::size_t end = std::min(images_, (t + 1) * kImagesPerTask);
      for (std::size_t i = t * kImagesPerTask; i < end; ++i) add_slices(i, y + kImageVector * i);
    });
  }

  std::uint64_t bytes() const {
    return sums_.bytes() + saved_.size() * 8 * product_scratch_doubles(*state_.batches);
  }

 private:
  void write_step(const double* x, std::size_t image) {
    double* record = state_.cameras->data() + kCameraRecord * image;
    const double f = record[12], k1 = record[13], k2 = record[14];
    const double step[9] = {
        x[3], x[4], x[5], x[0], x[1], x[2], x[6], k1 * x[6] + f * x[7], k2 * x[6] + f * x[8]};
    std::copy(step, step + 9, record + camera_record::kStep);
  }

  void add_slices(std::size_t image, double* y) {
    const std::size_t stride = kProductRecord * images_;
    double* total = &sums_[kProductRecord * image];
    for (std::size_t s = 1; s < slices_; ++s)
      for (int k = 0; k < 9; ++k) total[k] += total[s * stride + k];
    const double* record = state_.cameras->data() + kCameraRecord * image;
    std::copy(total, total + 6, y);
    y[6] = total[6] + record[13] * total[7] + record[14] * total[8];
    y[7] = record[12] * total[7];
    y[8] = record[12] * total[8];
  }

  HeldState state_;
  const Kernels& kernels_;
  Threads& threads_;
  std::size_t images_, slices_;
  Buffer<double> sums_;
  std::vector<Buffer<double>> saved_;
};

/// In mixed precision the operator is single until the system asks for double.
class ImplicitSolver : public CameraSolver {
 public:
  ImplicitSolver(const Columns& columns, const HeldState& state, bool mixed, const Kernels& kernels,
                 Threads& threads)
      : operator_(state, kernels, threads), blocks_(columns, threads), cg_(columns) {
    if (mixed) rounded_ = std::make_unique<FloatImplicitOperator>(columns, state, kernels, threads);
  }

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    const bool round = rounded_ && !system.precise;
    if (round) rounded_->prepare(system.vectors->squares.data());
    ImageOperator& S = round ? static_cast<ImageOperator&>(*rounded_) : operator_;
    return cg_.run(S, Preconditioner{blocks_, system.coarse}, system, x);
  }
  std::uint64_t bytes() const override {
    return operator_.bytes() + (rounded_ ? rounded_->bytes() : 0) + blocks_.bytes() + cg_.bytes();
  }

 private:
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
