// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "eliminate/kernels.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/camera_solver.h"

namespace sheaf {

/// The sums over images of an implicit product, double whatever the product's own precision. Slices
/// of chunks sum apart and are added in order.
class ProductSums {
 public:
  ProductSums(const HeldState& state, Threads& threads)
      : state_(state),
        threads_(threads),
        images_(state.cameras->size() / kCameraRecord),
        slices_(state.chunks->slices.size() - 1),
        sums_(slices_ * kProductRecord * images_),
        saved_(threads.count()) {}

  /// Calls task(image) for every image.
  template <class Task>
  void for_each_image(const Task& task) {
    constexpr std::size_t kImagesPerTask = 1024;
    threads_.for_each((images_ + kImagesPerTask - 1) / kImagesPerTask, [&](std::size_t t) {
      const std::size_t end = std::min(images_, (t + 1) * kImagesPerTask);
      for (std::size_t i = t * kImagesPerTask; i < end; ++i) task(i);
    });
  }

  /// Calls product(chunk, saved, sums) for every chunk, then finish(image, total) for every image
  /// with its sums, kProductRecord of them.
  template <class Product, class Finish>
  void run(const Product& product, const Finish& finish) {
    const std::size_t stride = kProductRecord * images_;
    threads_.for_each(slices_, [&](std::size_t s) {
      Buffer<double>& saved = saved_[threads_.worker()];
      if (saved.size() == 0) saved.allocate(product_scratch_doubles(*state_.batches));
      double* sums = &sums_[s * stride];
      std::fill_n(sums, stride, 0.0);
      const auto& slices = state_.chunks->slices;
      for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
        product(state_.chunks->chunks[c], saved.data(), sums);
    });
    for_each_image([&](std::size_t i) {
      double* total = &sums_[kProductRecord * i];
      for (std::size_t s = 1; s < slices_; ++s)
        for (int k = 0; k < 9; ++k) total[k] += total[s * stride + k];
      finish(i, total);
    });
  }

  std::size_t num_images() const { return images_; }
  std::uint64_t bytes() const {
    return sums_.bytes() + saved_.size() * 8 * product_scratch_doubles(*state_.batches);
  }

 private:
  HeldState state_;
  Threads& threads_;
  std::size_t images_, slices_;
  Buffer<double> sums_;                ///< kProductRecord per image, one set per slice
  std::vector<Buffer<double>> saved_;  ///< one per thread
};

}  // namespace sheaf
