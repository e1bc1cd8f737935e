// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "eliminate/dogleg_kernels.h"
#include "eliminate/kernels.h"
#include "lists/columns.h"
#include "systems/dogleg_passes.h"
#include "systems/implicit_solver.h"
#include "systems/product_sums.h"

namespace sheaf {

/// What products through BAL lenses read: the held state, whose camera records carry x as their
/// step.
struct BalState {
  const Batches* batches;
  const Chunks* chunks;
  Buffer<double>* cameras;
  const Buffer<double>* points;
  const Buffer<double>* factors;
  const Buffer<double>* metric;  ///< of the loss; empty: none

  ProductInput input() const {
    return {batches, cameras->data(), points->data(), factors->data(), metric->data()};
  }
  double* record(std::size_t image) const { return cameras->data() + kCameraRecord * image; }
};

/// S x in double.
class BalOperator : public StateOperator {
 public:
  BalOperator(const Columns& columns, const BalState& state, const Kernels& kernels,
              Threads& threads);

  void prepare(const double*) override {}
  void apply(const double* x, double* y) override;
  std::uint64_t bytes() const override { return sums_.bytes(); }
  ProductSums& sums() { return sums_; }

 private:
  BalState state_;
  const Kernels& kernels_;
  ProductSums sums_;
};

/// S x in single precision; the sums over an image's observations are double. The scene is moved
/// and scaled, and x is scaled by its columns, before either is rounded: the result depends on no
/// unit and on no origin.
class FloatBalOperator : public StateOperator {
 public:
  /// sums: whichever operator runs may have them.
  FloatBalOperator(const Columns& columns, const BalState& state, const Kernels& kernels,
                   ProductSums& sums);

  void prepare(const double* squares) override;
  void apply(const double* x, double* y) override;
  std::uint64_t bytes() const override { return cameras_.bytes(); }

 private:
  double scale_of_step(const double* x) const;
  void write_step(const double* x, double scale, std::size_t image);

  const Columns& columns_;
  BalState state_;
  const Kernels& kernels_;
  std::size_t images_;
  double origin_[3] = {0, 0, 0}, scale_ = 1;
  const double* squares_ = nullptr;
  Buffer<float> cameras_;  ///< kFloatCameraRecord per image
  ProductSums& sums_;
};

/// What a dogleg asks of rows through BAL lenses.
class BalDogleg : public DoglegSource {
 public:
  BalDogleg(const BalState& state, const Kernels& kernels)
      : state_(state), kernels_(dogleg_kernels(kernels.name)) {}

  void write_steps(const double* x, std::size_t images) override;
  void gradient(const Chunk& chunk, double* sums) override {
    kernels_.gradient(state_.input(), chunk, sums);
  }
  void curvature(const Chunk& chunk, double lambda, bool points_held,
                 CurvatureOutput& out) override {
    kernels_.curvature({state_.input(), lambda, points_held}, chunk, out);
  }
  double point_damping(const Chunk& chunk) override {
    return kernels_.point_damping(state_.input(), chunk);
  }

 private:
  BalState state_;
  const DoglegKernels& kernels_;
};

}  // namespace sheaf
