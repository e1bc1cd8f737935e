// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/png.h"

#include <gtest/gtest.h>
#include <png.h>

#include <string>
#include <vector>

#include "image/canvas.h"

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

int count(const Image& image, Color color) {
  int n = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) n += image.at(x, y) == color;
  return n;
}

const Color kPaper{255, 255, 255}, kInk{10, 20, 30};

TEST(Canvas, RectanglesAndFramesHaveTheirPixels) {
  Image image(20, 20, kPaper);
  fill_rectangle(image, 3, 4, 7, 6, kInk);
  EXPECT_EQ(count(image, kInk), 8);
  EXPECT_EQ(image.at(3, 4), kInk);
  EXPECT_EQ(image.at(7, 5), kPaper);
  fill_rectangle(image, -5, 18, 100, 50, kInk);
  EXPECT_EQ(count(image, kInk), 8 + 40);
  draw_frame(image, 10, 10, 12, 13, kInk);
  EXPECT_EQ(count(image, kInk), 8 + 40 + 2 * 4 + 2 * 3);
}

TEST(Canvas, LinesEndWhereTheyShouldWhateverTheirDirection) {
  for (const auto& [x, y] :
       std::vector<std::pair<double, double>>{{18, 11}, {11, 18}, {2, 7}, {9, 1}}) {
    Image there(20, 20, kPaper), back(20, 20, kPaper);
    draw_line(there, 10, 9, x, y, 1, kInk);
    draw_line(back, x, y, 10, 9, 1, kInk);
    EXPECT_EQ(there.rgb, back.rgb);
    EXPECT_LT(there.at(10, 9).red, 140);
    EXPECT_LT(there.at(int(x), int(y)).red, 140);
  }
  Image image(20, 20, kPaper);
  draw_line(image, -1e5, 5, 1e5, 5, 1, kInk);  // clipped
  EXPECT_EQ(count(image, kInk), 20);
}

TEST(Canvas, TextIsAsWideAsItSays) {
  Image image(200, 40, kPaper), upwards(40, 200, kPaper);
  const std::string text = "The quick fox: 0123 (g, j) \xff";
  draw_text(image, 5, 6, text, 1, kInk);
  draw_text_upwards(upwards, 6, 194, text, 1, kInk);
  EXPECT_GT(count(image, kInk), 200);
  EXPECT_EQ(count(image, kInk), count(upwards, kInk));
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 200; ++x) {
      if (x < 5 || x >= 5 + text_width(text, 1) || y < 6 || y >= 15) {
        EXPECT_EQ(image.at(x, y), kPaper);
      }
      EXPECT_EQ(image.at(x, y), upwards.at(y, 199 - x));
    }
}

}  // namespace
}  // namespace sheaf
