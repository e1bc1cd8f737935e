// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/palette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "image/png.h"

namespace sheaf {
namespace {

/// Between stops at equal distances; t in [0, 1], what is not a number as 1.
template <std::size_t kStops>
Color between(const std::array<Color, kStops>& stops, double t) {
  const double x = (kStops - 1) * (std::isnan(t) ? 1.0 : std::clamp(t, 0.0, 1.0));
  const std::size_t i = std::min(kStops - 2, static_cast<std::size_t>(x));
  const double f = x - static_cast<double>(i);
  const auto mix = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround((1 - f) * a + f * b));
  };
  const Color &a = stops[i], &b = stops[i + 1];
  return {mix(a.red, b.red), mix(a.green, b.green), mix(a.blue, b.blue)};
}

}  // namespace

Color grey_shade(double level) {
  const auto grey = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
  return {grey, grey, grey};
}

Color signed_shade(double t) {
  constexpr std::array<Color, 5> kStops{
      {{24, 78, 158}, {120, 170, 214}, {247, 247, 247}, {240, 150, 110}, {178, 24, 43}}};
  return between(kStops, (1 + t) / 2);
}

Color size_shade(double t) {
  constexpr std::array<Color, 5> kStops{
      {{49, 84, 200}, {116, 190, 225}, {255, 240, 140}, {250, 140, 60}, {190, 10, 40}}};
  return between(kStops, t);
}

Result<void> draw_colour_bar(Drawing& out, double x, double y, Color (*shade)(double), double from,
                             double to, const std::string& low, const std::string& high,
                             const std::string& what) {
  constexpr int kWidth = Drawing::kBarShades;
  Image bar(kWidth, 1, kPaper);
  for (int k = 0; k < kWidth; ++k) bar.set(k, 0, shade(from + (to - from) * k / (kWidth - 1)));
  const Result<std::string> png = encode_png(bar);
  if (!png.ok()) return png.error();
  out.shade_bar(x, y, png.value(), low, high, what);
  return {};
}

}  // namespace sheaf
