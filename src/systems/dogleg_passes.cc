// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/dogleg_passes.h"

#include <array>

namespace sheaf {

DoglegPasses::DoglegPasses(const Columns& columns, const HeldState& state, bool points_held,
                           const Kernels& kernels, Threads& threads)
    : columns_(columns),
      state_(state),
      points_held_(points_held),
      kernels_(dogleg_kernels(kernels.name)),
      threads_(threads),
      sums_(state, threads),
      direction_((static_cast<std::size_t>(columns.count) + 7) / 8 * 8) {}

void DoglegPasses::descend(const double* damping, double lambda) {
  sum_gradient();
  gradient2_ = 0;
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    const double gradient = direction_[c];
    direction_[c] = lambda * gradient / damping[c];
    gradient2_ += gradient * direction_[c];
  }
  sum_curvature(lambda);
}

ProductInput DoglegPasses::state() const {
  return {state_.batches, state_.cameras->data(), state_.points->data(), state_.factors->data(),
          state_.weights->data()};
}

void DoglegPasses::write_steps(const Buffer<double>& columns) {
  sums_.for_each_image([&](std::size_t i) {
    double* record = state_.cameras->data() + kCameraRecord * i;
    double x[9];
    for (int k = 0; k < 9; ++k) {
      const std::int32_t c = columns_.image(i)[k];
      x[k] = c >= 0 ? columns[c] : 0;
    }
    camera_record::write_step(record + camera_record::kFocal, x, record + camera_record::kStep);
  });
}

/// direction_ <- beta of the cameras. Images that share a lens add to its columns in their order.
void DoglegPasses::sum_gradient() {
  const ProductInput in = state();
  std::vector<std::array<double, 9>> of_image(columns_.num_images());
  sums_.run([&](const Chunk& chunk, double*, double* sums) { kernels_.gradient(in, chunk, sums); },
            [&](std::size_t i, const double* total) {
              for (int k = 0; k < 9; ++k) of_image[i][k] = total[k];
            });
  direction_.fill(0);
  for (std::size_t i = 0; i < of_image.size(); ++i)
    for (int k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0) direction_[c] += of_image[i][k];
}

void DoglegPasses::sum_curvature(double lambda) {
  write_steps(direction_);
  const CurvatureInput in{state(), lambda, points_held_};
  const auto& slices = state_.chunks->slices;
  std::vector<CurvatureOutput> outputs(slices.size() - 1);
  threads_.for_each(outputs.size(), [&](std::size_t s) {
    for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
      kernels_.curvature(in, state_.chunks->chunks[c], outputs[s]);
  });
  curvature_ = 0;
  for (const CurvatureOutput& out : outputs) {
    curvature_ += out.square_sum;
    gradient2_ += out.gradient2;
  }
}

double DoglegPasses::point_damping(const Buffer<double>& step) {
  if (points_held_) return 0;
  write_steps(step);
  const ProductInput in = state();
  const auto& slices = state_.chunks->slices;
  std::vector<double> outputs(slices.size() - 1, 0.0);
  threads_.for_each(outputs.size(), [&](std::size_t s) {
    for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
      outputs[s] += kernels_.point_damping(in, state_.chunks->chunks[c]);
  });
  double sum = 0;
  for (double x : outputs) sum += x;
  return sum;
}

}  // namespace sheaf
