// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/simd_targets.h"
// After simd_targets.h:
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cmath>
#include <limits>

#include "platform/log1p-inl.h"

namespace sheaf {
namespace {

double lane_of_log1p(double z) {
  alignas(64) double out[8];
  HWY_NAMESPACE::store(HWY_NAMESPACE::log1p(HWY_NAMESPACE::set(z)), out);
  return out[0];
}

TEST(Log1p, IsWithinThreeUnitsOfTheLastPlace) {
  double worst = 0;
  const auto check = [&](double z) {
    const long double exact = std::log1p(static_cast<long double>(z));
    const double ulp =
        std::nextafter(static_cast<double>(exact), 1e300) - static_cast<double>(exact);
    worst = std::max(worst, static_cast<double>(std::abs(lane_of_log1p(z) - exact) / ulp));
  };
  for (double z = 1e-300; z < 1e300; z *= 1.37) check(z);
  for (double z = 1e-12; z < 100; z *= 1.0007) check(z);
  for (double edge : {std::sqrt(2.0) - 1, 1.0, std::sqrt(8.0) - 1, 3.0})
    for (double z : {edge, std::nextafter(edge, 0.0), std::nextafter(edge, 9.0)}) check(z);
  EXPECT_LT(worst, 3);
  EXPECT_EQ(lane_of_log1p(0), 0);
}

}  // namespace
}  // namespace sheaf
