// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/quantile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "platform/random.h"

namespace sheaf {
namespace {

double search(const std::vector<double>& values, double quantile) {
  QuantileSearch search(quantile, values.size());
  while (!search.done()) {
    std::vector<DigitCounts> parts(3);
    for (std::size_t i = 0; i < values.size(); ++i) search.count(values[i], parts[i % 2]);
    search.narrow(sum_of(parts));
  }
  return search.value();
}

TEST(Quantile, IsWhatSortingGives) {
  Random random(3);
  for (std::size_t n : {1u, 2u, 3u, 10u, 999u, 1000u}) {
    std::vector<double> values;
    for (std::size_t i = 0; i < n; ++i) values.push_back(std::abs(random.normal()));
    std::vector<double> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (double q : {0.0, 0.1, 0.5, 0.99, 1.0}) {
      const auto rank = static_cast<std::size_t>(std::max(1.0, std::ceil(q * n)));
      EXPECT_EQ(search(values, q), sorted[rank - 1]) << n << " values, " << q;
    }
  }
}

TEST(Quantile, BearsTiesZerosAndTheUncountable) {
  EXPECT_EQ(search({}, 0.5), 0);
  EXPECT_EQ(search({0, 0, 0, 0, 7}, 0.5), 0);
  EXPECT_EQ(search({2, 2, 2, 1, 3}, 0.5), 2);
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(search({1, inf, std::nan("")}, 0.3), 1);
  EXPECT_EQ(search({1, inf, std::nan("")}, 0.5), inf);
  EXPECT_TRUE(std::isnan(search({1, inf, std::nan("")}, 1)));
  EXPECT_EQ(search({5e-324, 1e308, 1e-300}, 0.3), 5e-324);
}

}  // namespace
}  // namespace sheaf
