// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/interpolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "image/grey.h"

namespace sheaf {
namespace {

constexpr Taps kAll[] = {Taps::bilinear_central, Taps::bilinear, Taps::catmull_rom};
constexpr int kWidth = 40, kHeight = 30;

template <class Function>
GreyPlane plane_of(const Function& f) {
  std::vector<float> pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) pixels.push_back(static_cast<float>(f(x, y)));
  return {kWidth, kHeight, pixels.data()};
}

GreyPlane texture() {
  return plane_of([](double x, double y) {
    return 128 + 60 * std::sin(0.7 * x + 0.3 * y) + 40 * std::cos(0.2 * x - 0.6 * y);
  });
}

TEST(Interpolation, WeightsSumToOneAndSlopesToNone) {
  for (Taps taps : kAll)
    for (double f : {0.0, 0.1, 0.5, 0.75, 0.999}) {
      const TapWeights w = tap_weights(taps, f);
      EXPECT_NEAR(w.value[0] + w.value[1] + w.value[2] + w.value[3], 1, 1e-15);
      EXPECT_NEAR(w.slope[0] + w.slope[1] + w.slope[2] + w.slope[3], 0, 1e-15);
      // Of a ramp the value is the place and the slope is one.
      EXPECT_NEAR(-w.value[0] + w.value[2] + 2 * w.value[3], f, 1e-15);
      EXPECT_NEAR(-w.slope[0] + w.slope[2] + 2 * w.slope[3], 1, 1e-15);
    }
}

TEST(Interpolation, PixelsComeBackAsTheyAre) {
  const GreyPlane plane = texture();
  for (Taps taps : kAll) EXPECT_EQ(sample(plane, taps, 11, 7).value, double(*plane.at(11, 7)));
}

TEST(Interpolation, CubicsReproduceQuadratics) {
  const auto f = [](double x, double y) { return 3 + x - 2 * y + 0.25 * x * x - 0.5 * x * y; };
  const GreySample at = sample(plane_of(f), Taps::catmull_rom, 12.3, 8.6);
  EXPECT_NEAR(at.value, f(12.3, 8.6), 1e-4);
  EXPECT_NEAR(at.dx, 1 + 0.5 * 12.3 - 0.5 * 8.6, 1e-4);
  EXPECT_NEAR(at.dy, -2 - 0.5 * 12.3, 1e-4);
}

TEST(Interpolation, ExactSlopesAreThoseOfFiniteDifferences) {
  const GreyPlane plane = texture();
  constexpr double h = 1e-4;
  for (Taps taps : {Taps::bilinear, Taps::catmull_rom})
    for (double x : {5.2, 17.9, 30.35})
      for (double y : {4.1, 12.77}) {
        const GreySample at = sample(plane, taps, x, y);
        const auto value = [&](double u, double v) { return sample(plane, taps, u, v).value; };
        EXPECT_NEAR(at.dx, (value(x + h, y) - value(x - h, y)) / (2 * h), 1e-5);
        EXPECT_NEAR(at.dy, (value(x, y + h) - value(x, y - h)) / (2 * h), 1e-5);
      }
}

// The slope of the course: interpolating central differences, and differencing the interpolant.
TEST(Interpolation, CentralDifferencesOfTheInterpolantAreTheInterpolantOfCentralDifferences) {
  const GreyPlane plane = texture();
  const double x = 9.3, y = 14.8;
  const GreySample at = sample(plane, Taps::bilinear_central, x, y);
  const auto value = [&](double u, double v) {
    return sample(plane, Taps::bilinear_central, u, v).value;
  };
  EXPECT_NEAR(at.dx, (value(x + 1, y) - value(x - 1, y)) / 2, 1e-12);
  EXPECT_NEAR(at.dy, (value(x, y + 1) - value(x, y - 1)) / 2, 1e-12);
}

TEST(Interpolation, CubicsComeCloserThanLines) {
  const auto f = [](double x, double y) { return 100 * std::sin(0.5 * x) * std::sin(0.4 * y); };
  const GreyPlane plane = plane_of(f);
  const double cubic = std::abs(sample(plane, Taps::catmull_rom, 15.5, 11.5).value - f(15.5, 11.5));
  const double line = std::abs(sample(plane, Taps::bilinear, 15.5, 11.5).value - f(15.5, 11.5));
  EXPECT_LT(cubic, line / 5);
}

TEST(GreyPlane, RepeatsItsBorder) {
  const GreyPlane plane = texture();
  EXPECT_EQ(*plane.at(-8, 3), *plane.at(0, 3));
  EXPECT_EQ(*plane.at(kWidth + 20, 3), *plane.at(kWidth - 1, 3));
  EXPECT_EQ(*plane.at(5, -8), *plane.at(5, 0));
  EXPECT_EQ(*plane.at(5, kHeight + 7), *plane.at(5, kHeight - 1));
}

TEST(GreyPlane, HalvingAveragesFourAndMovesTheOrigin) {
  // Of a ramp, the half-size pixel (x, y) shows what is at (2 x + 1/2, 2 y + 1/2).
  std::vector<float> ramp;
  for (int y = 0; y < 7; ++y)
    for (int x = 0; x < 9; ++x) ramp.push_back(static_cast<float>(3 * x + 5 * y));
  const std::vector<float> half = halve(9, 7, ramp.data());
  ASSERT_EQ(half.size(), 4u * 3u);
  EXPECT_FLOAT_EQ(half[4 * 2 + 3], 3 * (2 * 3 + 0.5f) + 5 * (2 * 2 + 0.5f));
}

TEST(Grey, ColoursAreWeighedAndSixteenBitsScaled) {
  const Raster colour{2, 1, 3, 8, {255, 0, 0, 0, 255, 255}};
  const std::vector<float> grey = grey_of(colour);
  EXPECT_FLOAT_EQ(grey[0], 0.299f * 255);
  EXPECT_FLOAT_EQ(grey[1], 0.701f * 255);
  EXPECT_FLOAT_EQ(grey_of(Raster{1, 1, 1, 16, {65535}})[0], 255);
}

}  // namespace
}  // namespace sheaf
