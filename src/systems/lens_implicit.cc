// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/lens_implicit.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "reduced/block_diagonal.h"
#include "reduced/conjugate_gradients.h"
#include "reduced/preconditioner.h"

namespace sheaf {
namespace {

/// S x with the rows computed again. Slices of chunks sum apart and are added in order.
class LensOperator : public ImageOperator {
 public:
  LensOperator(const Columns& columns, const Chunks& chunks, const LensKernels& kernels,
               Threads& threads)
      : chunks_(chunks),
        kernels_(kernels),
        threads_(threads),
        stride_(kProductRecord * columns.num_images()),
        sums_((chunks.slices.size() - 1) * stride_),
        saved_(static_cast<std::size_t>(threads.count())) {}

  void begin(const LensProductInput& held) {
    held_ = held;
    const std::size_t doubles = product_scratch_doubles(*held.of.batches, *held.of.tracks);
    for (Buffer<double>& saved : saved_)
      if (saved.size() == 0) saved.allocate(doubles);
  }

  void apply(const double* x, double* y) override {
    LensProductInput in = held_;
    in.x = x;
    const std::size_t slices = chunks_.slices.size() - 1;
    threads_.for_each(slices, [&](std::size_t s) {
      double* sums = &sums_[s * stride_];
      double* saved = saved_[static_cast<std::size_t>(threads_.worker())].data();
      std::fill_n(sums, stride_, 0.0);
      for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
        kernels_.product(in, chunks_.chunks[c], saved, sums);
    });
    constexpr std::size_t kPerTask = 16384;
    threads_.for_ranges(stride_, kPerTask, [&](std::size_t i, std::size_t end) {
      for (; i < end; ++i) {
        y[i] = sums_[i];
        for (std::size_t s = 1; s < slices; ++s) y[i] += sums_[s * stride_ + i];
      }
    });
  }

  std::uint64_t bytes() const {
    std::uint64_t sum = sums_.bytes();
    for (const Buffer<double>& saved : saved_) sum += saved.bytes();
    return sum;
  }

 private:
  const Chunks& chunks_;
  const LensKernels& kernels_;
  Threads& threads_;
  const std::size_t stride_;
  Buffer<double> sums_;                ///< kProductRecord per block, one set per slice
  std::vector<Buffer<double>> saved_;  ///< one per thread
  LensProductInput held_{};
};
static_assert(kProductRecord == kImageVector);

class LensImplicitSolver : public CameraSolver {
 public:
  LensImplicitSolver(const Columns& columns, const Chunks& chunks,
                     std::function<LensProductInput()> held, const LensKernels& kernels,
                     Threads& threads)
      : held_(std::move(held)),
        operator_(columns, chunks, kernels, threads),
        blocks_(columns, threads),
        cg_(columns) {}

  CameraSolution solve(const CameraSystem& system, Buffer<double>& x) override {
    if (!blocks_.factor(system.sums.diagonal, system.damping)) return {};
    operator_.begin(held_());
    return cg_.run(operator_, Preconditioner{blocks_, system.coarse}, system, x);
  }
  std::uint64_t bytes() const override { return operator_.bytes() + blocks_.bytes() + cg_.bytes(); }

 private:
  std::function<LensProductInput()> held_;
  LensOperator operator_;
  BlockDiagonal blocks_;
  ConjugateGradients cg_;
};

}  // namespace

std::unique_ptr<CameraSolver> make_lens_implicit_solver(const Columns& columns,
                                                        const Chunks& chunks,
                                                        std::function<LensProductInput()> held,
                                                        const LensKernels& kernels,
                                                        Threads& threads) {
  return std::make_unique<LensImplicitSolver>(columns, chunks, std::move(held), kernels, threads);
}

}  // namespace sheaf
