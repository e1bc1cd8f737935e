// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sheaf {

struct Color {
  std::uint8_t red = 0, green = 0, blue = 0;
  bool operator==(const Color&) const = default;
};

/// Pixels row by row from the top left, three bytes each (sRGB).
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  Image(int width, int height, Color background)
      : width(width), height(height), rgb(3 * std::size_t(width) * std::size_t(height)) {
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) set(x, y, background);
  }

  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  Color at(int x, int y) const {
    return {rgb[place(x, y)], rgb[place(x, y) + 1], rgb[place(x, y) + 2]};
  }
  void set(int x, int y, Color color) {
    std::uint8_t* p = &rgb[place(x, y)];
    p[0] = color.red, p[1] = color.green, p[2] = color.blue;
  }

 private:
  std::size_t place(int x, int y) const {
    return 3 * (std::size_t(y) * std::size_t(width) + std::size_t(x));
  }
};

}  // namespace sheaf
