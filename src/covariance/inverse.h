// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "covariance/linear_function.h"
#include "covariance/normal_equations.h"

namespace sheaf {

/// The inverse of the normal equations in a gauge, as far as it is asked for.
class Inverse {
 public:
  virtual ~Inverse() = default;

  /// rows x rows, of a function of some blocks that rows couple pair by pair.
  virtual std::vector<double> of(const LinearFunction& function) const = 0;
  /// rows of a x rows of b, of two of the functions that it was made for, of any blocks.
  virtual std::vector<double> across(std::size_t a, std::size_t b) const = 0;
  /// 3 x 3, of an eliminated point at X.
  virtual std::array<double, 9> of(const NormalEquations::Point& point, const double* X) const = 0;
  /// Whether the column's variance is finite.
  virtual bool determined(std::int32_t column) const = 0;
};

}  // namespace sheaf
