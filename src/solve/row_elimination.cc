// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/row_elimination.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sheaf {
namespace {

/// A column of which less than this part of its first length is left is made of the ones before it,
/// or of those that were taken out: the rest is rounding.
constexpr double kDetermined = 1e-11;

}  // namespace

double* DenseRows::add() {
  numbers_.resize(numbers_.size() + columns_ + 1, 0.0);
  return row(count() - 1);
}

std::size_t DenseRows::reflect(std::size_t among, std::vector<std::size_t>& order) {
  const std::size_t rows = count(), width = columns_ + 1;
  order.resize(among);
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::vector<double> whole(columns_, 0), left(among), sums(width), v(rows);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t c = 0; c < columns_; ++c) whole[c] += row(i)[c] * row(i)[c];
  for (std::size_t c = 0; c < columns_; ++c) squares_[c] = std::max(squares_[c], whole[c]);
  std::size_t rank = 0;
  for (; rank < std::min(among, rows); ++rank) {
    // Lengths are summed anew: those that are brought up to date lose the digits that decide.
    std::fill(left.begin(), left.end(), 0.0);
    for (std::size_t i = rank; i < rows; ++i)
      for (std::size_t c = 0; c < among; ++c) left[c] += row(i)[c] * row(i)[c];
    const auto part = [&](std::size_t c) { return squares_[c] > 0 ? left[c] / squares_[c] : 0; };
    const auto pivot =
        std::max_element(order.begin() + static_cast<std::ptrdiff_t>(rank), order.end(),
                         [&](std::size_t a, std::size_t b) { return part(a) < part(b); });
    if (!(part(*pivot) > kDetermined * kDetermined)) break;
    std::swap(order[rank], *pivot);
    const std::size_t c = order[rank];
    const double length = std::sqrt(left[c]), head = row(rank)[c];
    const double to = head > 0 ? -length : length;
    for (std::size_t i = rank; i < rows; ++i) v[i] = row(i)[c];
    v[rank] -= to;
    const double by = 1 / (length * (length + std::abs(head)));  // 2 / |v|^2
    std::fill(sums.begin(), sums.end(), 0.0);
    for (std::size_t i = rank; i < rows; ++i)
      for (std::size_t k = 0; k < width; ++k) sums[k] += v[i] * row(i)[k];
    for (std::size_t i = rank; i < rows; ++i)
      for (std::size_t k = 0; k < width; ++k) row(i)[k] -= by * v[i] * sums[k];
    row(rank)[c] = to;
    for (std::size_t i = rank + 1; i < rows; ++i) row(i)[c] = 0;
  }
  return rank;
}

void DenseRows::eliminate(std::size_t eliminated) {
  std::vector<std::size_t> order;
  const std::size_t rank = reflect(eliminated, order), rows = count();
  const std::size_t left = columns_ - eliminated;
  std::vector<double> numbers;
  numbers.reserve((rows - rank) * (left + 1));
  for (std::size_t i = rank; i < rows; ++i)
    numbers.insert(numbers.end(), row(i) + eliminated, row(i) + columns_ + 1);
  columns_ = left;
  squares_.erase(squares_.begin(), squares_.begin() + static_cast<std::ptrdiff_t>(eliminated));
  numbers_ = std::move(numbers);
}

std::vector<double> DenseRows::compress() {
  std::vector<std::size_t> order;
  const std::size_t rank = reflect(columns_, order);
  numbers_.resize(rank * (columns_ + 1));
  std::vector<double> mean(columns_, 0);
  for (std::size_t i = rank; i-- > 0;) {
    double sum = -row(i)[columns_];
    for (std::size_t k = i + 1; k < rank; ++k) sum -= row(i)[order[k]] * mean[order[k]];
    mean[order[i]] = sum / row(i)[order[i]];
  }
  return mean;
}

}  // namespace sheaf
