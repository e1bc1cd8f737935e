// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace sheaf {
namespace {

TEST(Chart, DigitsAreThoseThatCount) {
  EXPECT_EQ(digits(0.65637), "0.656");
  EXPECT_EQ(digits(9.9997), "10.0");
  EXPECT_EQ(digits(99.96), "100");
  EXPECT_EQ(digits(0.0009996), "0.00100");
  EXPECT_EQ(digits(18033.9), "18\u202f000");
  EXPECT_EQ(digits(-2.5, 2), "\u22122.5");
  EXPECT_EQ(digits(2504000), "2.50\u202f·\u202f10\u2076");
  EXPECT_EQ(digits(999960), "1.00\u202f·\u202f10\u2076");
  EXPECT_EQ(digits(1.5e-7, 2), "1.5\u202f·\u202f10\u207b\u2077");
  EXPECT_EQ(digits(0), "0");
  EXPECT_EQ(digits(std::nan("")), "\u2013");
  EXPECT_EQ(digits(std::numeric_limits<double>::infinity()), "\u2013");
  EXPECT_NE(digits(1.7e308), "");
  EXPECT_NE(digits(5e-324), "");
}

TEST(Chart, ColumnsAndTicksHaveTheirForms) {
  EXPECT_EQ(decimals(1234.567, 2), "1234.57");
  EXPECT_EQ(decimals(12345.678, 1), "12\u202f345.7");
  EXPECT_EQ(decimals(-0.001, 2), "0.00");
  EXPECT_EQ(decimals(-1.005, 1), "\u22121.0");
  EXPECT_EQ(grouped(9999), "9999");
  EXPECT_EQ(grouped(-1234567), "\u22121\u202f234\u202f567");
  EXPECT_EQ(tick_text(0.25), "0.25");
  EXPECT_EQ(tick_text(100000), "10\u2075");
  EXPECT_EQ(tick_text(2e-8), "2·10\u207b\u2078");
  EXPECT_EQ(tick_text(1e-8), "10\u207b\u2078");
  EXPECT_EQ(tick_text(-20000), "\u221220\u202f000");
  EXPECT_EQ(percent(0.3894), "39\u202f%");
  EXPECT_EQ(seconds_text(0.0787), "79\u202fms");
  EXPECT_EQ(seconds_text(12.34), "12.3\u202fs");
  EXPECT_EQ(count_text(1, "lens", "lenses"), "1 lens");
}

TEST(Chart, TextsStayText) {
  EXPECT_EQ(escaped("<script>\"'&"), "&lt;script&gt;&quot;&#39;&amp;");
  EXPECT_EQ(escaped("\x1b[31m\n\x7f"), "\uFFFD[31m\uFFFD\uFFFD");
  EXPECT_EQ(escaped("Tür \xc3\x28 \xff"), "Tür \uFFFD( \uFFFD");
  EXPECT_EQ(escaped("\u202egnp.exe"), "\uFFFDgnp.exe");
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD");  // half of a surrogate pair
  EXPECT_EQ(coordinate(12.34), "12.3");
  EXPECT_EQ(coordinate(-0.04), "0");
  EXPECT_EQ(coordinate(7), "7");
  EXPECT_EQ(coordinate(std::nan("")), "0");
  EXPECT_EQ(coordinate(1e300), "1000000");
}

}  // namespace
}  // namespace sheaf
