// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/dogleg_passes.h"

#include <utility>

namespace sheaf {

DoglegPasses::DoglegPasses(std::unique_ptr<DoglegSource> source, const Columns& columns,
                           const Chunks& chunks, std::size_t blocks, bool points_held,
                           Threads& threads)
    : source_(std::move(source)),
      columns_(columns),
      chunks_(chunks),
      points_held_(points_held),
      threads_(threads),
      sums_(chunks, blocks, 0, threads),
      direction_((static_cast<std::size_t>(columns.count) + 7) / 8 * 8),
      solved_(kBlockVector * columns.num_images()),
      of_rows_(kBlockVector * blocks) {
  solved_.fill(0);
  of_rows_.fill(0);
}

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

void DoglegPasses::write_steps(const Buffer<double>& columns) {
  for (std::size_t i = 0; i < columns_.num_images(); ++i)
    for (std::size_t k = 0; k < 9; ++k) {
      const std::int32_t c = columns_.image(i)[k];
      solved_[kBlockVector * i + k] = c >= 0 ? columns[static_cast<std::size_t>(c)] : 0;
    }
  source_->write_steps(solved_.data(), columns_.num_images());
}

/// direction_ <- beta of the cameras. Images that share a lens add to its columns in their order.
void DoglegPasses::sum_gradient() {
  sums_.run([&](const Chunk& chunk, double*, double* sums) { source_->gradient(chunk, sums); },
            [&](std::size_t i, const double* total) {
              std::copy_n(total, 9, &of_rows_[kBlockVector * i]);
            });
  source_->gather(of_rows_.data(), sums_.num_blocks(), solved_.data());
  direction_.fill(0);
  for (std::size_t i = 0; i < columns_.num_images(); ++i)
    for (std::size_t k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
        direction_[static_cast<std::size_t>(c)] += solved_[kBlockVector * i + k];
}

void DoglegPasses::sum_curvature(double lambda) {
  write_steps(direction_);
  const auto& slices = chunks_.slices;
  std::vector<CurvatureOutput> outputs(slices.size() - 1);
  threads_.for_each(outputs.size(), [&](std::size_t s) {
    for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
      source_->curvature(chunks_.chunks[c], lambda, points_held_, outputs[s]);
  });
  curvature_ = source_->other_curvature();
  for (const CurvatureOutput& out : outputs) {
    curvature_ += out.square_sum;
    gradient2_ += out.gradient2;
  }
}

double DoglegPasses::point_damping(const Buffer<double>& step) {
  if (points_held_) return 0;
  write_steps(step);
  const auto& slices = chunks_.slices;
  std::vector<double> outputs(slices.size() - 1, 0.0);
  threads_.for_each(outputs.size(), [&](std::size_t s) {
    for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
      outputs[s] += source_->point_damping(chunks_.chunks[c]);
  });
  double sum = 0;
  for (double x : outputs) sum += x;
  return sum;
}

}  // namespace sheaf
