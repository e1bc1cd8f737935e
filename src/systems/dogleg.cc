// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/dogleg.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

double curvature_of(const DoglegPlane& p, const DoglegStep& s) {
  return s.descent * s.descent * p.vHv + 2 * s.descent * s.newton * p.vHn +
         s.newton * s.newton * p.nHn;
}

double slope_of(const DoglegPlane& p, const DoglegStep& s) {
  return s.descent * p.vv + s.newton * p.vn;
}

double square_of(const DoglegPlane& p, const DoglegStep& s) {
  return s.descent * s.descent * p.vv + 2 * s.descent * s.newton * p.vn +
         s.newton * s.newton * p.nn;
}

}  // namespace

double length_of(const DoglegPlane& plane, const DoglegStep& step) {
  return std::sqrt(std::max(0.0, square_of(plane, step)));
}

double decrease_of(const DoglegPlane& plane, const DoglegStep& step) {
  return slope_of(plane, step) - curvature_of(plane, step) / 2;
}

double damping_of(const DoglegPlane& plane, const DoglegStep& step) {
  return (slope_of(plane, step) - curvature_of(plane, step)) / square_of(plane, step);
}

DoglegStep dogleg(const DoglegPlane& plane, double radius) {
  if (!(plane.nn > radius * radius)) return {1, 0};
  const double whole = std::sqrt(plane.vv);
  const double bend = plane.vHv + plane.damping * plane.vv;
  const double cauchy = bend > 0 ? plane.vv / bend : radius / whole;
  if (cauchy * whole >= radius) return {0, radius / whole};
  // |(1 - t) cauchy v + t n|^2 = radius^2: a t^2 + 2 b t = c, with the root that does not cancel.
  const double vv = cauchy * cauchy * plane.vv, vn = cauchy * plane.vn;
  const double a = vv - 2 * vn + plane.nn, b = vn - vv, c = radius * radius - vv;
  const double root = std::sqrt(std::max(0.0, b * b + a * c));
  const double t = b > 0 ? c / (b + root) : (root - b) / a;
  return {t, (1 - t) * cauchy};
}

DoglegStep best_in_plane(const DoglegPlane& plane, double radius) {
  // An orthonormal basis of the plane: along v, and what is left of n.
  const double v = std::sqrt(plane.vv), along = plane.vn / v;
  const double across2 = plane.nn - along * along;
  const double h11 = plane.vHv / plane.vv;
  if (!(across2 > 1e-14 * plane.nn))
    return {0, std::min(h11 > 0 ? 1 / h11 : radius / v, radius / v)};
  const double across = std::sqrt(across2);
  const double g1 = v, g2 = (plane.vn - along * v) / across;
  const double h12 = (plane.vHn - along * plane.vHv / v) / (v * across);
  const double h22 = (plane.nHn - 2 * along * plane.vHn / v + along * along * h11) / across2;
  // (H + sigma I) x = g with the least sigma >= 0 that keeps |x| within the radius.
  double low = 0, high = 0, x1 = 0, x2 = 0;
  // The bits of std::hypot depend on the processor.
  const auto length = [](double x, double y) { return std::sqrt(x * x + y * y); };
  const auto outside = [&](double sigma) {
    const double a = h11 + sigma, b = h22 + sigma, determinant = a * b - h12 * h12;
    x1 = (g1 * b - g2 * h12) / determinant, x2 = (a * g2 - h12 * g1) / determinant;
    return !(a > 0 && determinant > 0 && length(x1, x2) <= radius);
  };
  high = length(g1, g2) / radius;
  for (int i = 0; i < 100 && outside(high); ++i) high *= 2;
  for (int i = 0; i < 100 && outside(low); ++i) {
    const double middle = (low + high) / 2;
    (outside(middle) ? low : high) = middle;
  }
  if (outside(low)) outside(high);
  return {x2 / across, (x1 - x2 * along / across) / v};
}

}  // namespace sheaf
