// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/png.h"

#include <gtest/gtest.h>
#include <png.h>

#include <string>
#include <vector>

namespace sheaf {
namespace {

// By libpng's other half.
std::vector<std::uint8_t> decode(const std::string& bytes, int& width, int& height) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return {};
  png.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, rgb.data(), 0, nullptr) == 0) return {};
  width = static_cast<int>(png.width);
  height = static_cast<int>(png.height);
  return rgb;
}

TEST(Png, ComesBackAsItWas) {
  Image image(37, 11, {250, 240, 230});
  for (int y = 0; y < 11; ++y)
    for (int x = 0; x < 37; x += 2)
      image.set(x, y, {std::uint8_t(7 * x), std::uint8_t(20 * y), std::uint8_t(x * y)});
  int width = 0, height = 0;
  const auto rgb = decode(encode_png(image).value(), width, height);
  EXPECT_EQ(width, 37);
  EXPECT_EQ(height, 11);
  EXPECT_EQ(rgb, image.rgb);
}

TEST(Png, RefusesAnImageWithoutPixels) {
  const auto result = encode_png(Image(0, 5, {}));
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code(), ErrorCode::unwritable_output);
}

}  // namespace
}  // namespace sheaf
