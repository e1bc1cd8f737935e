// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/conjugate_gradients.h"

#include <algorithm>
#include <cmath>

namespace sheaf {

namespace {

std::size_t padded_length(const Columns& columns) {
  return (static_cast<std::size_t>(columns.count) + 7) / 8 * 8;
}

}  // namespace

ConjugateGradients::ConjugateGradients(const Columns& columns)
    : columns_(columns), modes_(padded_length(columns)) {
  const std::size_t padded = padded_length(columns);
  for (Buffer<double>* v : {&r_, &z_, &p_, &q_}) {
    v->allocate(padded);
    v->fill(0);
  }
  image_x_.allocate(kImageVector * columns.num_images());
  image_y_.allocate(kImageVector * columns.num_images());
  image_x_.fill(0);
}

std::uint64_t ConjugateGradients::bytes() const {
  return path_.bytes() + modes_.bytes() + 4 * r_.bytes() + 2 * image_x_.bytes();
}

void ConjugateGradients::start(const double* b, Buffer<double>& x) {
  x.fill(0);
  std::copy(b, b + r_.size(), r_.begin());
}

void ConjugateGradients::apply(ImageOperator& S, const double* damping) {
  const std::size_t images = columns_.num_images();
  for (std::size_t i = 0; i < images; ++i)
    for (int k = 0; k < 9; ++k) {
      const std::int32_t c = columns_.image(i)[k];
      image_x_[kImageVector * i + k] = c >= 0 ? p_[c] : 0;
    }
  S.apply(image_x_.data(), image_y_.data());
  for (std::int32_t c = 0; c < columns_.count; ++c) q_[c] = damping[c] * p_[c];
  for (std::size_t i = 0; i < images; ++i)
    for (int k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
        q_[c] += image_y_[kImageVector * i + k];
}

CameraSolution ConjugateGradients::shorten(const CameraSystem& system, Buffer<double>& x) {
  if (!path_.cut(metric(system), system.radius, x, r_)) return {};
  return {true, 0, r_.data(), true};
}

SteihaugPath::Metric ConjugateGradients::metric(const CameraSystem& system) const {
  return {system.damping, system.lambda, static_cast<std::size_t>(columns_.count)};
}

double ConjugateGradients::length(const CameraSystem& system, const Buffer<double>& x) const {
  return std::sqrt(metric(system).product(x.data(), x.data()));
}

double ConjugateGradients::longest_step(const CameraSystem& system, const Buffer<double>& x) const {
  return std::isinf(system.radius)
             ? system.radius
             : distance_to_boundary(metric(system), x.data(), p_.data(), system.radius);
}

void ConjugateGradients::copy(const Buffer<double>& from, Buffer<double>& to) {
  std::copy(from.begin(), from.end(), to.begin());
}

double ConjugateGradients::dot(const Buffer<double>& a, const Buffer<double>& b) {
  double lanes[8] = {};
  for (std::size_t i = 0; i < a.size(); i += 8)
    for (int l = 0; l < 8; ++l) lanes[l] += a[i + l] * b[i + l];
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

void ConjugateGradients::axpy(double alpha, const Buffer<double>& x, Buffer<double>& y) {
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += alpha * x[i];
}

void ConjugateGradients::scale_add(double beta, const Buffer<double>& z, Buffer<double>& p) {
  for (std::size_t i = 0; i < z.size(); ++i) p[i] = z[i] + beta * p[i];
}

}  // namespace sheaf
