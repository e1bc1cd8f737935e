// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/canvas.h"

#include <algorithm>
#include <cmath>

#include "image/font.h"

namespace sheaf {
namespace {

void mix(Image& image, int x, int y, Color color, double strength) {
  if (!image.contains(x, y) || strength <= 0) return;
  const Color old = image.at(x, y);
  const double s = std::min(strength, 1.0);
  const auto blend = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround((1 - s) * a + s * b));
  };
  image.set(
      x, y,
      {blend(old.red, color.red), blend(old.green, color.green), blend(old.blue, color.blue)});
}

template <class Dot>
void for_each_dot(const std::string& text, int scale, const Dot& dot) {
  int left = 0;
  for (const char c : text) {
    const Glyph& glyph = glyph_of(c);
    for (int row = 0; row < kGlyphRows; ++row)
      for (int column = 0; column < kGlyphColumns; ++column)
        if (glyph[static_cast<std::size_t>(row)] >> (kGlyphColumns - 1 - column) & 1)
          dot(left + scale * column, scale * row);
    left += scale * (kGlyphColumns + 1);
  }
}

}  // namespace

void fill_rectangle(Image& image, int x0, int y0, int x1, int y1, Color color) {
  for (int y = std::max(y0, 0); y < std::min(y1, image.height); ++y)
    for (int x = std::max(x0, 0); x < std::min(x1, image.width); ++x) image.set(x, y, color);
}

void draw_frame(Image& image, int x0, int y0, int x1, int y1, Color color) {
  fill_rectangle(image, x0 - 1, y0 - 1, x1 + 1, y0, color);
  fill_rectangle(image, x0 - 1, y1, x1 + 1, y1 + 1, color);
  fill_rectangle(image, x0 - 1, y0, x0, y1, color);
  fill_rectangle(image, x1, y0, x1 + 1, y1, color);
}

void draw_line(Image& image, double x0, double y0, double x1, double y1, double width, Color color,
               double strength) {
  const double length = std::hypot(x1 - x0, y1 - y0);
  if (!(length > 0) || !std::isfinite(length)) return;
  const bool flat = std::fabs(x1 - x0) >= std::fabs(y1 - y0);
  if (flat ? x0 > x1 : y0 > y1) {
    std::swap(x0, x1);
    std::swap(y0, y1);
  }
  const double begin = flat ? x0 : y0, end = flat ? x1 : y1;
  const double slope = flat ? (y1 - y0) / (x1 - x0) : (x1 - x0) / (y1 - y0);
  const double half = width / 2 * std::sqrt(1 + slope * slope);  // across, along the other axis
  const int limit = flat ? image.width : image.height;
  for (int a = std::max(0, static_cast<int>(std::lround(begin)));
       a <= std::min<double>(limit - 1, std::lround(end)); ++a) {
    const double middle = (flat ? y0 : x0) + slope * (a - begin);
    for (int b = static_cast<int>(std::floor(middle - half));
         b <= static_cast<int>(std::ceil(middle + half)); ++b) {
      const double cover = std::clamp(half + 0.5 - std::fabs(b - middle), 0.0, 1.0);
      mix(image, flat ? a : b, flat ? b : a, color, strength * cover);
    }
  }
}

void fill_circle(Image& image, double x, double y, double radius, Color color) {
  for (int b = static_cast<int>(y - radius) - 1; b <= static_cast<int>(y + radius) + 1; ++b)
    for (int a = static_cast<int>(x - radius) - 1; a <= static_cast<int>(x + radius) + 1; ++a)
      mix(image, a, b, color, std::clamp(radius + 0.5 - std::hypot(a - x, b - y), 0.0, 1.0));
}

void draw_text(Image& image, int x, int y, const std::string& text, int scale, Color color) {
  for_each_dot(text, scale, [&](int along, int down) {
    fill_rectangle(image, x + along, y + down, x + along + scale, y + down + scale, color);
  });
}

void draw_text_upwards(Image& image, int x, int y, const std::string& text, int scale,
                       Color color) {
  for_each_dot(text, scale, [&](int along, int down) {
    fill_rectangle(image, x + down, y - along - scale + 1, x + down + scale, y - along + 1, color);
  });
}

int text_width(const std::string& text, int scale) {
  const int letters = static_cast<int>(text.size());
  return letters == 0 ? 0 : scale * (letters * (kGlyphColumns + 1) - 1);
}

}  // namespace sheaf
