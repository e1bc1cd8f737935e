// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/steihaug_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sheaf {

double SteihaugPath::Metric::product(const double* a, const double* b) const {
  double sum = 0;
  for (std::size_t c = 0; c < columns; ++c) sum += damping[c] / lambda * a[c] * b[c];
  return sum;
}

double distance_to_boundary(const SteihaugPath::Metric& metric, const double* x, const double* p,
                            double radius) {
  const double xp = metric.product(x, p), pp = metric.product(p, p);
  const double left = std::max(0.0, radius * radius - metric.product(x, x));
  const double root = std::sqrt(xp * xp + pp * left);
  return xp > 0 ? left / (xp + root) : (root - xp) / pp;
}

void SteihaugPath::begin(const Buffer<double>& residual) {
  count_ = 0;
  Iterate& start = next(residual.size());
  start.x.fill(0);
  std::copy(residual.begin(), residual.end(), start.residual.begin());
  start.length = 0;
}

void SteihaugPath::add(const Buffer<double>& x, const Buffer<double>& residual, double length) {
  if (count_ == kMost) drop_the_closest();
  Iterate& to = next(x.size());
  std::copy(x.begin(), x.end(), to.x.begin());
  std::copy(residual.begin(), residual.end(), to.residual.begin());
  to.length = length;
}

SteihaugPath::Iterate& SteihaugPath::next(std::size_t size) {
  if (count_ == iterates_.size()) iterates_.emplace_back();
  Iterate& to = iterates_[count_++];
  if (to.x.size() != size) to.x.allocate(size), to.residual.allocate(size);
  return to;
}

std::uint64_t SteihaugPath::bytes() const {
  std::uint64_t sum = 0;
  for (const Iterate& at : iterates_) sum += at.x.bytes() + at.residual.bytes();
  return sum;
}

/// Of those between the first and the last, the one whose neighbours' lengths differ least.
void SteihaugPath::drop_the_closest() {
  std::size_t closest = 2;
  for (std::size_t i = 2; i + 1 < count_; ++i)
    if (iterates_[i + 1].length * iterates_[closest - 1].length <
        iterates_[closest + 1].length * iterates_[i - 1].length)
      closest = i;
  std::rotate(iterates_.begin() + static_cast<std::ptrdiff_t>(closest),
              iterates_.begin() + static_cast<std::ptrdiff_t>(closest) + 1,
              iterates_.begin() + static_cast<std::ptrdiff_t>(count_));
  --count_;
}

bool SteihaugPath::cut(const Metric& metric, double radius, Buffer<double>& x,
                       Buffer<double>& residual) const {
  std::size_t end = 1;
  while (end < count_ && iterates_[end].length < radius) ++end;
  if (end >= count_) return false;
  const Iterate &a = iterates_[end - 1], &b = iterates_[end];
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = b.x[i] - a.x[i];
  const double t = std::min(1.0, distance_to_boundary(metric, a.x.data(), x.data(), radius));
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = a.x[i] + t * x[i];
    residual[i] = a.residual[i] + t * (b.residual[i] - a.residual[i]);
  }
  return true;
}

}  // namespace sheaf
