// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "platform/buffer.h"

namespace sheaf {

/// The path from 0 through the iterates of conjugate gradients. Straight between them, it may be
/// cut at any length without another product. Of many iterates those are kept whose lengths are far
/// apart; on a chord past the others the model's decrease grows too.
class SteihaugPath {
 public:
  /// At 0, with the right-hand side as its residual.
  void begin(const Buffer<double>& residual);
  /// length: |x|_C.
  void add(const Buffer<double>& x, const Buffer<double>& residual, double length);

  /// Weights of the columns in |x|_C^2: damping / lambda.
  struct Metric {
    const double* damping;
    double lambda;
    std::size_t columns;

    double product(const double* a, const double* b) const;
  };
  /// The first point as long as the radius and its residual; false: the path ends before.
  bool cut(const Metric& metric, double radius, Buffer<double>& x, Buffer<double>& residual) const;

  std::uint64_t bytes() const;
  static std::uint64_t most_bytes(std::uint64_t columns) { return 2 * 8 * kMost * columns; }

 private:
  static constexpr std::size_t kMost = 16;
  struct Iterate {
    Buffer<double> x, residual;
    double length = 0;
  };
  Iterate& next(std::size_t size);
  void drop_the_closest();

  std::vector<Iterate> iterates_;
  std::size_t count_ = 0;
};

/// How far along p the radius is met: |x + tau p|_C = radius, tau >= 0.
double distance_to_boundary(const SteihaugPath::Metric& metric, const double* x, const double* p,
                            double radius);

}  // namespace sheaf
