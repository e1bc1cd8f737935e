// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/bal_operators.h"

#include <algorithm>
#include <cmath>

#include "reduced/scaling.h"

namespace sheaf {

BalOperator::BalOperator(const Columns& columns, const BalState& state, const Kernels& kernels,
                         Threads& threads)
    : state_(state),
      kernels_(kernels),
      sums_(*state.chunks, columns.num_images(), product_scratch_doubles(*state.batches), threads) {
}

void BalOperator::apply(const double* x, double* y) {
  for (std::size_t i = 0; i < sums_.num_blocks(); ++i)
    camera_record::write_step(state_.record(i) + camera_record::kFocal, x + kImageVector * i,
                              state_.record(i) + camera_record::kStep);
  const ProductInput in = state_.input();
  sums_.run([&](const Chunk& chunk, double* saved,
                double* sums) { kernels_.product(in, chunk, saved, sums); },
            [&](std::size_t i, const double* total) {
              read_product(state_.record(i) + camera_record::kFocal, total, y + kImageVector * i);
            });
}

void BalDogleg::write_steps(const double* x, std::size_t images) {
  for (std::size_t i = 0; i < images; ++i) {
    double* record = state_.record(i);
    camera_record::write_step(record + camera_record::kFocal, x + kImageVector * i,
                              record + camera_record::kStep);
  }
}

FloatBalOperator::FloatBalOperator(const Columns& columns, const BalState& state,
                                   const Kernels& kernels, ProductSums& sums)
    : columns_(columns),
      state_(state),
      kernels_(kernels),
      images_(columns.num_images()),
      cameras_(kFloatCameraRecord * images_),
      sums_(sums) {
  cameras_.fill(0);
}

/// The origin is the mean of the camera centres -R^T t, the unit of length the mean of |P.xyz| of
/// the cameras about it: both in fixed order.
void FloatBalOperator::prepare(const double* squares) {
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
      t[k] = R[camera_record::kTranslation + k] + R[3 * k] * origin_[0] +
             R[3 * k + 1] * origin_[1] + R[3 * k + 2] * origin_[2];
  };
  double length = 0;
  for (std::size_t i = 0; i < images_; ++i) {
    double t[3];
    moved(records + kCameraRecord * i, t);
    length += std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  }
  scale_ = towards_one(length / static_cast<double>(images_));
  sums_.for_each_block([&](std::size_t i) {
    const double* R = records + kCameraRecord * i;
    float* to = &cameras_[kFloatCameraRecord * i];
    double t[3];
    moved(R, t);
    for (int k = 0; k < 9; ++k) to[k] = static_cast<float>(R[k]);
    for (int k = 0; k < 3; ++k) {
      to[camera_record::kTranslation + k] = static_cast<float>(scale_ * t[k]);
      to[camera_record::kFocal + k] = static_cast<float>(R[camera_record::kFocal + k]);
    }
  });
}

/// x scaled by its columns is what the residuals see of it, at most in pixels: next to 1.
double FloatBalOperator::scale_of_step(const double* x) const {
  double most = 0;
  for (std::size_t i = 0; i < images_; ++i)
    for (int k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
        most = std::max(most, std::sqrt(squares_[c]) * std::abs(x[kImageVector * i + k]));
  return towards_one(most);
}

void FloatBalOperator::apply(const double* x, double* y) {
  const double scale = scale_of_step(x);
  sums_.for_each_block([&](std::size_t i) { write_step(x + kImageVector * i, scale, i); });
  const FloatProductInput in{state_.batches,
                             cameras_.data(),
                             state_.points->data(),
                             state_.factors->data(),
                             {origin_[0], origin_[1], origin_[2]},
                             scale_,
                             state_.metric->data()};
  sums_.run(
      [&](const Chunk& chunk, double* saved, double* sums) {
        kernels_.product_float(in, chunk, reinterpret_cast<float*>(saved), sums);
      },
      [&](std::size_t i, double* total) {
        for (int k = 0; k < 9; ++k) total[k] *= k < 3 ? 1 / scale * scale_ : 1 / scale;
        read_product(state_.cameras->data() + kCameraRecord * i + camera_record::kFocal, total,
                     y + kImageVector * i);
      });
}

void FloatBalOperator::write_step(const double* x, double scale, std::size_t image) {
  double step[9];
  camera_record::write_step(state_.cameras->data() + kCameraRecord * image + camera_record::kFocal,
                            x, step);
  double* rho = step + (camera_record::kRho - camera_record::kStep);
  for (int k = 0; k < 3; ++k) rho[k] = scale_ * rho[k];
  float* to = &cameras_[kFloatCameraRecord * image + camera_record::kStep];
  for (int k = 0; k < 9; ++k) to[k] = static_cast<float>(scale * step[k]);
}

}  // namespace sheaf
