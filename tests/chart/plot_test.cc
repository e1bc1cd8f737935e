// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "chart/svg_file.h"

namespace sheaf {
namespace {

using Ticks = std::vector<double>;

TEST(Chart, TicksAreRoundAndWithin) {
  EXPECT_EQ(round_ticks(0, 10), (Ticks{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(round_ticks(-2.4, 2.4, 6), (Ticks{-2, -1, 0, 1, 2}));
  EXPECT_EQ(round_ticks(3, 3), Ticks{3});
  EXPECT_EQ(decade_ticks(0.02, 2000), (Ticks{0.1, 1, 10, 100, 1000}));
  EXPECT_EQ(decade_ticks(1e-6, 1, 4).size(), 4u);
  EXPECT_EQ(log_ticks(0.9, 11), (Ticks{1, 2, 5, 10}));
  EXPECT_LE(log_ticks(0.01, 1000).size(), 6u);
  for (const double x : {0.37, 1.0, 49.0, 2e7}) {
    const double below = round_below(x);
    EXPECT_LE(below, x);
    EXPECT_GT(2.5 * below, x);
  }
}

TEST(Chart, AxesPlaceValues) {
  const Axis linear{-1, 1, 100, 0, false}, logarithmic{1, 100, 0, 50, true};
  EXPECT_DOUBLE_EQ(linear(0.5), 25);
  EXPECT_DOUBLE_EQ(logarithmic(10), 25);
  EXPECT_LT(logarithmic(0), -50);
  EXPECT_TRUE(std::isfinite(logarithmic(0)));
}

TEST(Chart, FilesAreSvgWithTheirStyle) {
  Drawing drawing;
  drawing.text_upwards(10, 90, "up & up", "m", Anchor::middle);
  drawing.picture(1, 2, 30, 40, "foo");
  const std::string svg = svg_file(drawing, 100, 50, "<two>");
  EXPECT_EQ(svg.rfind("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100\" height=\"50\"", 0),
            0u);
  EXPECT_NE(svg.find("<title>&lt;two&gt;</title>"), std::string::npos);
  EXPECT_NE(svg.find("<style>"), std::string::npos);
  EXPECT_NE(svg.find("<text transform=\"translate(10 90) rotate(-90)\" class=\"m\" "
                     "text-anchor=\"middle\">up &amp; up</text>"),
            std::string::npos);
  EXPECT_NE(svg.find("<image x=\"1\" y=\"2\" width=\"30\" height=\"40\" "
                     "preserveAspectRatio=\"none\" href=\"data:image/png;base64,Zm9v\"/>"),
            std::string::npos);
}

TEST(Chart, PlotsAreSvgWithText) {
  Plot plot({0, 10}, {0, 1});
  plot.axis_x(round_ticks(0, 10), "px");
  plot.line({0, 10}, {0, 1}, "after");
  plot.steps({0, 5, 10}, {1, 0.5}, "before", true);
  plot.text(3, 4, "a < b", "t");
  const std::string svg = plot.svg("of \"this\"");
  EXPECT_NE(svg.find("viewBox=\"0 0 360 224\""), std::string::npos);
  EXPECT_NE(svg.find("aria-label=\"of &quot;this&quot;\""), std::string::npos);
  EXPECT_NE(svg.find("<path d=\"M8 190L352 12\" class=\"after\"/>"), std::string::npos) << svg;
  EXPECT_NE(svg.find("M8 190V12H180V101H352V190Z"), std::string::npos) << svg;
  EXPECT_NE(svg.find("10\u202fpx"), std::string::npos);
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(Chart, NothingToDrawIsNoPath) {
  Plot plot({5, 5}, {0, 0});
  plot.line({}, {}, "after");
  plot.band({}, {}, {}, "fill");
  EXPECT_EQ(plot.content(), "");
}

}  // namespace
}  // namespace sheaf
