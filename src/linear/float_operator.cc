// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "linear/float_operator.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

/// The power of two that brings x next to 1; 1 where there is none.
double towards_one(double x) {
  return x > 0 && std::isfinite(x) ? std::ldexp(1.0, -std::ilogb(x)) : 1;
}

}  // namespace

FloatImplicitOperator::FloatImplicitOperator(const Columns& columns, const HeldState& state,
                                             const Kernels& kernels, Threads& threads)
    : columns_(columns),
      state_(state),
      kernels_(kernels),
      threads_(threads),
      images_(columns.num_images()),
      slices_(state.chunks->slices.size() - 1),
      cameras_(kFloatCameraRecord * images_),
      sums_(slices_ * kProductRecord * images_),
      saved_(threads.count()) {
  cameras_.fill(0);
}

template <class Task>
void FloatImplicitOperator::for_each_image(const Task& task) {
  constexpr std::size_t kImagesPerTask = 1024;
  threads_.for_each((images_ + kImagesPerTask - 1) / kImagesPerTask, [&](std::size_t t) {
    const std::size_t end = std::min(images_, (t + 1) * kImagesPerTask);
    for (std::size_t i = t * kImagesPerTask; i < end; ++i) task(i);
  });
}

/// The origin is the mean of the camera centres -R^T t, the unit of length the mean of |P.xyz| of
/// the cameras about it: both in fixed order.
void FloatImplicitOperator::prepare(const double* squares) {
  squares_ = squares;
  const double* records = state_.cameras->data();
  double sum[3] = {0, 0, 0};
  for (std::size_t i = 0; i < images_; ++i) {
    const double *R = records + kCameraRecord * i, *t = R + camera_record::kTranslation;
    for (int k = 0; k < 3; ++k) sum[k] -= R[k] * t[0] + R[3 + k] * t[1] + R[6 + k] * t[2];
  }
  for (int k = 0; k < 3; ++k) origin_[k] = sum[k] / static_cast<double>(images_);
  const auto moved = [&](const double* R, double* t) {
    for (int k = 0; k < 3; ++k)
      t[k] =
          R[9 + k] + R[3 * k] * origin_[0] + R[3 * k + 1] * origin_[1] + R[3 * k + 2] * origin_[2];
  };
  double length = 0;
  for (std::size_t i = 0; i < images_; ++i) {
    double t[3];
    moved(records + kCameraRecord * i, t);
    length += std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  }
  scale_ = towards_one(length / static_cast<double>(images_));
  for_each_image([&](std::size_t i) {
    const double* R = records + kCameraRecord * i;
    float* to = &cameras_[kFloatCameraRecord * i];
    double t[3];
    moved(R, t);
    for (int k = 0; k < 9; ++k) to[k] = static_cast<float>(R[k]);
    for (int k = 0; k < 3; ++k) {
      to[9 + k] = static_cast<float>(scale_ * t[k]);
      to[12 + k] = static_cast<float>(R[12 + k]);
    }
  });
}

/// x scaled by its columns is what the residuals see of it, at most in pixels: next to 1.
double FloatImplicitOperator::scale_of_step(const double* x) const {
  double most = 0;
  for (std::size_t i = 0; i < images_; ++i)
    for (int k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
        most = std::max(most, std::sqrt(squares_[c]) * std::abs(x[kImageVector * i + k]));
  return towards_one(most);
}

void FloatImplicitOperator::apply(const double* x, double* y) {
  const double scale = scale_of_step(x);
  for_each_image([&](std::size_t i) { write_step(x + kImageVector * i, scale, i); });
  const FloatProductInput in{state_.batches,
                             cameras_.data(),
                             state_.points->data(),
                             state_.factors->data(),
                             {origin_[0], origin_[1], origin_[2]},
                             scale_,
                             state_.weights->data()};
  const std::size_t stride = kProductRecord * images_;
  threads_.for_each(slices_, [&](std::size_t s) {
    Buffer<double>& saved = saved_[threads_.worker()];
    if (saved.size() == 0) saved.allocate(product_scratch_doubles(*state_.batches));
    double* sums = &sums_[s * stride];
    std::fill_n(sums, stride, 0.0);
    const auto& slices = state_.chunks->slices;
    for (std::uint32_t c = slices[s]; c < slices[s + 1]; ++c)
      kernels_.product_float(in, state_.chunks->chunks[c], reinterpret_cast<float*>(saved.data()),
                             sums);
  });
  for_each_image([&](std::size_t i) { add_slices(i, 1 / scale, y + kImageVector * i); });
}

void FloatImplicitOperator::write_step(const double* x, double scale, std::size_t image) {
  const double* record = state_.cameras->data() + kCameraRecord * image;
  const double f = record[12], k1 = record[13], k2 = record[14];
  const double step[9] = {x[3],
                          x[4],
                          x[5],
                          scale_ * x[0],
                          scale_ * x[1],
                          scale_ * x[2],
                          x[6],
                          k1 * x[6] + f * x[7],
                          k2 * x[6] + f * x[8]};
  float* to = &cameras_[kFloatCameraRecord * image + camera_record::kStep];
  for (int k = 0; k < 9; ++k) to[k] = static_cast<float>(scale * step[k]);
}

void FloatImplicitOperator::add_slices(std::size_t image, double scale, double* y) {
  const std::size_t stride = kProductRecord * images_;
  double total[9];
  for (int k = 0; k < 9; ++k) {
    total[k] = sums_[kProductRecord * image + k];
    for (std::size_t s = 1; s < slices_; ++s)
      total[k] += sums_[s * stride + kProductRecord * image + k];
    total[k] *= k < 3 ? scale * scale_ : scale;
  }
  const double* record = state_.cameras->data() + kCameraRecord * image;
  std::copy(total, total + 6, y);
  y[6] = total[6] + record[13] * total[7] + record[14] * total[8];
  y[7] = record[12] * total[7];
  y[8] = record[12] * total[8];
}

std::uint64_t FloatImplicitOperator::bytes() const {
  return cameras_.bytes() + sums_.bytes() +
         saved_.size() * 8 * product_scratch_doubles(*state_.batches);
}

}  // namespace sheaf
