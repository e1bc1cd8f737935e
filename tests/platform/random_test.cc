// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/random.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <vector>

#include "platform/portable_math.h"

namespace sheaf {
namespace {

double ulp(double x) { return std::nextafter(std::fabs(x), 1e300) - std::fabs(x); }

TEST(PortableMath, SineAndCosineAgreeWithTheLibrary) {
  Random random(1);
  for (int i = 0; i < 100000; ++i) {
    const double x = i < 50000 ? random.uniform(-4, 4) : random.uniform(-1e4, 1e4);
    const SineCosine sc = portable_sine_cosine(x);
    ASSERT_NEAR(sc.sine, std::sin(x), 3e-16) << x;
    ASSERT_NEAR(sc.cosine, std::cos(x), 3e-16) << x;
  }
  EXPECT_EQ(portable_sine_cosine(0).sine, 0);
  EXPECT_EQ(portable_sine_cosine(0).cosine, 1);
}

TEST(PortableMath, ArcTangentAgreesWithTheLibrary) {
  Random random(2);
  for (int i = 0; i < 100000; ++i) {
    const double x = random.normal() * (i % 3 == 0 ? 1e-6 : 1);
    const double y = random.normal() * (i % 3 == 1 ? 1e-6 : 1);
    const double expected = std::atan2(y, x);
    ASSERT_NEAR(portable_atan2(y, x), expected, 4 * ulp(expected)) << y << ' ' << x;
  }
  EXPECT_EQ(portable_atan2(0, 0), 0);
  EXPECT_EQ(portable_atan2(0, 2), 0);
  EXPECT_EQ(portable_atan2(3, 0), std::atan2(3, 0));
}

TEST(PortableMath, LogarithmAgreesWithTheLibrary) {
  Random random(3);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::ldexp(1 + random.uniform(), static_cast<int>(random.below(200)) - 100);
    const double expected = std::log(x);
    ASSERT_NEAR(portable_log(x), expected, 2 * ulp(expected) + 1e-17) << x;
  }
  EXPECT_EQ(portable_log(1), 0);
}

TEST(Random, FirstNumbersArePinned) {
  // Computed by an independent transcription of splitmix64 and xoshiro256++.
  Random random(1);
  EXPECT_EQ(random.next(), 0xcfc5d07f6f03c29bu);
  EXPECT_EQ(random.next(), 0xbf424132963fe08du);
  EXPECT_EQ(random.next(), 0x19a37d5757aaf520u);
}

TEST(Random, UniformFillsTheUnitIntervalEvenly) {
  Random random(7);
  std::vector<int> bins(16);
  const int draws = 160000;
  for (int i = 0; i < draws; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    ++bins[static_cast<std::size_t>(u * 16)];
  }
  double chi2 = 0;
  for (const int count : bins) chi2 += (count - 10000.0) * (count - 10000.0) / 10000.0;
  EXPECT_LT(chi2, 37.7);  // 15 degrees of freedom, p = 0.001
}

TEST(Random, BelowIsEven) {
  Random random(8);
  std::vector<int> bins(7);
  for (int i = 0; i < 70000; ++i) ++bins[random.below(7)];
  double chi2 = 0;
  for (const int count : bins) chi2 += (count - 10000.0) * (count - 10000.0) / 10000.0;
  EXPECT_LT(chi2, 22.5);  // 6 degrees of freedom, p = 0.001
  for (int i = 0; i < 10; ++i) EXPECT_EQ(random.below(1), 0u);
}

TEST(Random, NormalHasTheMomentsAndTailsOfAGaussian) {
  Random random(9);
  const int draws = 400000;
  double sum = 0, squares = 0, fourths = 0;
  int beyond2 = 0, beyond3 = 0;
  for (int i = 0; i < draws; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
    fourths += x * x * x * x;
    beyond2 += std::fabs(x) > 2;
    beyond3 += std::fabs(x) > 3;
  }
  EXPECT_NEAR(sum / draws, 0, 0.006);
  EXPECT_NEAR(squares / draws, 1, 0.01);
  EXPECT_NEAR(fourths / draws, 3, 0.06);
  EXPECT_NEAR(beyond2 / double(draws), 0.045500, 0.0015);
  EXPECT_NEAR(beyond3 / double(draws), 0.002700, 0.0004);
}

TEST(Random, NormalHasTheSameBitsEverywhere) {
  Random random(1);
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (int i = 0; i < 1000; ++i) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(random.normal())) * 0x100000001b3u;
  }
  EXPECT_EQ(hash, 0xe0c31e05302af5d5u);  // as a transcription in another language has it
}

TEST(Random, StreamsDiffer) {
  Random a(5, 0), b(5, 1), c(6, 0), again(5, 1);
  const std::uint64_t x = b.next();
  EXPECT_NE(a.next(), x);
  EXPECT_NE(c.next(), x);
  EXPECT_EQ(again.next(), x);
}

}  // namespace
}  // namespace sheaf
