// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/point_sigma.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/rotation.h"

namespace sheaf {
namespace {

/// How a camera sees the points of a sight: P = R d + s t.
struct View {
  Matrix3<double> R;
  Vector3<double> t;
};

View view_of(const PatchScene& scene, const PatchState& state, const Sight& sight) {
  const Pose& target = state.poses[sight.image];
  View view{matrix_from_quaternion(target.rotation), target.translation};
  if (!scene.has_rays()) return view;
  const Pose& host = state.poses[scene.host[sight.point]];
  const Matrix3<double> T = view.R, H = matrix_from_quaternion(host.rotation);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      view.R[3 * i + j] =
          T[3 * i] * H[3 * j] + T[3 * i + 1] * H[3 * j + 1] + T[3 * i + 2] * H[3 * j + 2];
  const Vector3<double> moved = multiply(view.R, host.translation);
  for (std::size_t i = 0; i < 3; ++i) view.t[i] -= moved[i];
  return view;
}

double dot(const double (&a)[4], const double (&b)[4]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

/// The variance of what is read at (x, y) when every pixel's is 1.
double variance_at(Taps taps, double x, double y) {
  const TapWeights across = tap_weights(taps, x - std::floor(x));
  const TapWeights down = tap_weights(taps, y - std::floor(y));
  return dot(across.value, across.value) * dot(down.value, down.value);
}

/// L of the symmetric H = L L^T, in its lower triangle; false where H is singular to rounding.
bool factor(std::array<double, 9>& H, std::size_t size) {
  for (std::size_t j = 0; j < size; ++j) {
    const double whole = H[3 * j + j];
    double pivot = whole;
    for (std::size_t k = 0; k < j; ++k) pivot -= H[3 * j + k] * H[3 * j + k];
    if (!(pivot > 1e-12 * whole)) return false;
    H[3 * j + j] = std::sqrt(pivot);
    for (std::size_t i = j + 1; i < size; ++i) {
      for (std::size_t k = 0; k < j; ++k) H[3 * i + j] -= H[3 * i + k] * H[3 * j + k];
      H[3 * i + j] /= H[3 * j + j];
    }
  }
  return true;
}

/// x <- (L L^T)^-1 x.
void solve(const std::array<double, 9>& L, std::size_t size, std::array<double, 3>& x) {
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= L[3 * i + k] * x[k];
    x[i] /= L[3 * i + i];
  }
  for (std::size_t i = size; i-- > 0;) {
    for (std::size_t k = i + 1; k < size; ++k) x[i] -= L[3 * k + i] * x[k];
    x[i] /= L[3 * i + i];
  }
}

}  // namespace

PointSigma::PointSigma(const PatchScene& scene, double sigma)
    : scene_(scene), sigma_(sigma), unknowns_(scene.has_rays() ? 1 : 3) {
  clear();
}

void PointSigma::clear() {
  reference_.assign(scene_.grid.place.size(), Column{});
  H_.fill(0);
  B_.fill(0);
}

/// The patch's pixels in an image, each with J_k.
void PointSigma::place(const PatchState& state, const Sight& sight) {
  const View view = view_of(scene_, state, sight);
  const Pinhole& k = scene_.camera;
  const bool rays = scene_.has_rays();
  const double* X = &state.points[3 * std::size_t(sight.point)];
  const double* d = rays ? &scene_.rays[3 * std::size_t(sight.point)] : X;
  const double s = rays ? X[0] : 1;
  pixels_.clear();
  for (const std::uint32_t cell : scene_.grid.place) {
    const double dx = scene_.grid.dx[cell], dy = scene_.grid.dy[cell];
    Vector3<double> ray{d[0], d[1], d[2]};
    if (scene_.warped) ray[0] += dx / k.fx, ray[1] += dy / k.fy;
    Vector3<double> P = multiply(view.R, ray);
    for (std::size_t i = 0; i < 3; ++i) P[i] += s * view.t[i];
    Pixel at{k.fx * P[0] / P[2] + k.cx, k.fy * P[1] / P[2] + k.cy, {}, {}, {}};
    if (!scene_.warped) at.x += dx, at.y += dy;
    const GreySample grey = sample(scene_.planes[sight.image], scene_.taps, at.x, at.y);
    const double fx = k.fx / P[2], fy = k.fy / P[2];
    const auto move = [&](std::size_t i) { return rays ? view.t[i / 3] : view.R[i]; };
    for (std::size_t c = 0; c < static_cast<std::size_t>(unknowns_); ++c) {
      at.by_x[c] = fx * (move(c) - P[0] / P[2] * move(6 + c));
      at.by_y[c] = fy * (move(3 + c) - P[1] / P[2] * move(6 + c));
      at.c[c] = grey.dx * at.by_x[c] + grey.dy * at.by_y[c];
    }
    pixels_.push_back(at);
  }
}

void PointSigma::place_in_host(std::uint32_t point) {
  const double* ray = &scene_.rays[3 * std::size_t(point)];
  const double x = scene_.camera.fx * ray[0] + scene_.camera.cx;
  const double y = scene_.camera.fy * ray[1] + scene_.camera.cy;
  pixels_.clear();
  for (std::size_t k = 0; k < reference_.size(); ++k) {
    const std::uint32_t cell = scene_.grid.place[k];
    pixels_.push_back({x + scene_.grid.dx[cell], y + scene_.grid.dy[cell], reference_[k], {}, {}});
  }
}

void PointSigma::add_outer(const Column& c) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) B_[3 * i + j] += c[i] * c[j];
}

/// Entry (i, j) of E_k: what noise makes of the product of two entries of J_k.
double PointSigma::noise_of(const Pixel& at, std::size_t i, std::size_t j) const {
  const TapWeights across = tap_weights(scene_.taps, at.x - std::floor(at.x));
  const TapWeights down = tap_weights(scene_.taps, at.y - std::floor(at.y));
  const double xx = dot(across.slope, across.slope) * dot(down.value, down.value);
  const double yy = dot(across.value, across.value) * dot(down.slope, down.slope);
  const double xy = dot(across.slope, across.value) * dot(down.value, down.slope);
  return sigma_ * sigma_ *
         (xx * at.by_x[i] * at.by_x[j] + yy * at.by_y[i] * at.by_y[j] +
          xy * (at.by_x[i] * at.by_y[j] + at.by_y[i] * at.by_x[j]));
}

/// Adds c_p c_p^T of the pixels that the patch at hand is read from.
void PointSigma::spread() {
  double left = pixels_[0].x, right = left, top = pixels_[0].y, bottom = top;
  for (const Pixel& at : pixels_) {
    left = std::min(left, at.x), right = std::max(right, at.x);
    top = std::min(top, at.y), bottom = std::max(bottom, at.y);
  }
  const double x0 = std::floor(left) - 1, y0 = std::floor(top) - 1;
  const auto width = static_cast<std::size_t>(std::floor(right) + 3 - x0);
  const auto height = static_cast<std::size_t>(std::floor(bottom) + 3 - y0);
  window_.assign(width * height, Column{});
  for (const Pixel& at : pixels_) {
    const double x = std::floor(at.x), y = std::floor(at.y);
    const TapWeights across = tap_weights(scene_.taps, at.x - x);
    const TapWeights down = tap_weights(scene_.taps, at.y - y);
    const std::size_t first =
        static_cast<std::size_t>(y - 1 - y0) * width + static_cast<std::size_t>(x - 1 - x0);
    for (std::size_t b = 0; b < 4; ++b)
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          window_[first + b * width + a][i] += down.value[b] * across.value[a] * at.c[i];
  }
  for (const Column& c : window_) add_outer(c);
}

void PointSigma::add(const PatchState& state, const Sight& sight, const ScaledLoss& loss,
                     bool loss_per_patch, const std::vector<double>& residuals) {
  place(state, sight);
  const double alpha = relative_brightness(scene_, state, sight).a;
  double square = 0;
  for (double r : residuals) square += r * r;
  const double of_patch = evaluate_loss(loss, square).first;
  const auto size = static_cast<std::size_t>(unknowns_);
  double whole = 0, noise = 0;  // traces of what the patch adds to H, and of E in it
  for (std::size_t k = 0; k < pixels_.size(); ++k) {
    const double weight =
        loss_per_patch ? of_patch : evaluate_loss(loss, residuals[k] * residuals[k]).first;
    Column& c = pixels_[k].c;
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t j = 0; j < size; ++j) {
        const double seen = weight * c[i] * c[j], false_part = weight * noise_of(pixels_[k], i, j);
        H_[3 * i + j] += seen - false_part;
        if (i == j) whole += seen, noise += false_part;
      }
    for (std::size_t i = 0; i < size; ++i) {
      c[i] *= weight;
      reference_[k][i] -= alpha * c[i];
    }
  }
  // Of an image's noise times its own slope's the sum over a patch almost cancels: n n' = (n^2)'/2.
  const double real = whole > 0 ? std::sqrt(std::max(0.0, 1 - noise / whole)) : 0;
  for (Pixel& at : pixels_)
    for (double& c : at.c) c *= real;
  spread();
}

void PointSigma::sigmas(std::uint32_t point, double* out) {
  const auto size = static_cast<std::size_t>(unknowns_);
  std::fill_n(out, size, std::numeric_limits<double>::infinity());
  std::array<double, 9> L = H_;
  if (!factor(L, size)) return;
  if (scene_.has_rays()) {
    place_in_host(point);
    spread();
  } else {
    for (const Column& c : reference_) add_outer(c);
  }
  for (std::size_t i = 0; i < size; ++i) {
    Column e{};
    e[i] = 1;
    solve(L, size, e);
    double variance = 0;
    for (std::size_t a = 0; a < size; ++a)
      for (std::size_t b = 0; b < size; ++b) variance += e[a] * B_[3 * a + b] * e[b];
    out[i] = sigma_ * std::sqrt(variance);
  }
}

void PointSigma::variances(const PatchState& state, const Sight& sight, std::vector<double>& out) {
  const double alpha = relative_brightness(scene_, state, sight).a;
  out.assign(scene_.grid.place.size(), alpha * alpha);
  if (scene_.has_rays()) {
    place_in_host(sight.point);
    for (std::size_t k = 0; k < out.size(); ++k)
      out[k] *= variance_at(scene_.taps, pixels_[k].x, pixels_[k].y);
  }
  place(state, sight);
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] += variance_at(scene_.taps, pixels_[k].x, pixels_[k].y);
}

}  // namespace sheaf
