// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sheaf {

/// Rows A x + b of a least-squares cost 1/2 |A x + b|^2, with b behind the columns of A.
class DenseRows {
 public:
  explicit DenseRows(std::size_t columns) : columns_(columns), squares_(columns, 0) {}

  std::size_t columns() const { return columns_; }  ///< of A
  std::size_t count() const { return numbers_.size() / (columns_ + 1); }
  double* row(std::size_t i) { return numbers_.data() + (columns_ + 1) * i; }
  const double* row(std::size_t i) const { return numbers_.data() + (columns_ + 1) * i; }
  /// One more, of zeros.
  double* add();

  /// Takes the first `eliminated` columns out: of the x there, what is left is the least that any
  /// of them allow. By Householder reflections with pivoted columns, which see the rows themselves
  /// and not their squares, so that no digit is lost that the rows have. Directions of these
  /// columns that no row determines are left out.
  void eliminate(std::size_t eliminated);

  /// Brings the rows into upper trapezoidal form S (x - mean), with as many rows as directions are
  /// determined; what of b no x reaches is a constant of the cost and goes. Columns stay in their
  /// order. Returns the mean, of which directions that are not determined are 0.
  std::vector<double> compress();

 private:
  /// Reflects rows from `first` on so that each pivot column in turn is zero below its row, among
  /// the first `among` columns. Returns how many were determined; `order` are the columns.
  std::size_t reflect(std::size_t among, std::vector<std::size_t>& order);

  std::size_t columns_;
  std::vector<double> numbers_;
  std::vector<double> squares_;  ///< of each column, before anything was taken out
};

}  // namespace sheaf
