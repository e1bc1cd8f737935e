// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "platform/buffer.h"

namespace sheaf {

/// The reductions that decide something: what a home whose parts lie on several machines has to
/// agree on. Here one machine holds all parts, so that its own figures are everybody's. The sums
/// over observations are none of these: they stay where the observations are.
class Reduction {
 public:
  virtual ~Reduction() = default;

  /// Replaces each value by its sum over all parts, in the order of the parts.
  virtual void sum(double*, std::size_t) const {}
  /// Replaces each value by the largest of all parts.
  virtual void max(double*, std::size_t) const {}
  /// a . b over all columns; in eight chains, so that the sum has one order on every machine. The
  /// sizes are equal and multiples of eight.
  virtual double dot(const Buffer<double>& a, const Buffer<double>& b) const {
    double lanes[8] = {};
    for (std::size_t i = 0; i < a.size(); i += 8)
      for (std::size_t l = 0; l < 8; ++l) lanes[l] += a[i + l] * b[i + l];
    return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
           ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
  }
};

/// That of a home which holds all parts.
inline const Reduction& local_reduction() {
  static const Reduction local;
  return local;
}

}  // namespace sheaf
