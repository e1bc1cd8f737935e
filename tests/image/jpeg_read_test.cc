// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <jpeglib.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "image/jpeg.h"
#include "image/png.h"

namespace sheaf {
namespace {

/// A smooth image, by libjpeg's other half.
Raster smooth(int channels) {
  Raster raster{50, 35, channels, 8, {}};
  for (int y = 0; y < raster.height; ++y)
    for (int x = 0; x < raster.width; ++x)
      for (int c = 0; c < channels; ++c)
        raster.samples.push_back(static_cast<std::uint16_t>(3 * x + 2 * y + 10 * c));
  return raster;
}

std::string encoded(const Raster& raster) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = static_cast<JDIMENSION>(raster.width);
  jpeg.image_height = static_cast<JDIMENSION>(raster.height);
  jpeg.input_components = raster.channels;
  jpeg.in_color_space = raster.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 98, TRUE);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<JSAMPLE> samples(raster.samples.begin(), raster.samples.end());
  const std::size_t row = std::size_t(raster.width) * std::size_t(raster.channels);
  while (jpeg.next_scanline < jpeg.image_height) {
    JSAMPROW from = &samples[row * jpeg.next_scanline];
    jpeg_write_scanlines(&jpeg, &from, 1);
  }
  jpeg_finish_compress(&jpeg);
  std::string out(reinterpret_cast<char*>(memory), size);
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return out;
}

TEST(JpegRead, SamplesComeBackUpToTheirCompression) {
  for (int channels : {1, 3}) {
    const Raster before = smooth(channels);
    const Raster after = decode_image(encoded(before), "x.jpg").value();
    ASSERT_EQ(after.width, 50);
    ASSERT_EQ(after.height, 35);
    ASSERT_EQ(after.channels, channels);
    ASSERT_EQ(after.bits, 8);
    ASSERT_EQ(after.samples.size(), before.samples.size());
    double sum = 0;
    for (std::size_t i = 0; i < after.samples.size(); ++i)
      sum += std::abs(double(after.samples[i]) - double(before.samples[i]));
    EXPECT_LT(sum / double(after.samples.size()), 1.5);
  }
}

TEST(JpegRead, RefusesWhatIsBrokenByItsName) {
  const std::string good = encoded(smooth(3));
  std::string lie = good;
  const std::size_t frame = lie.find("\xff\xc0");
  ASSERT_NE(frame, std::string::npos);
  for (std::size_t k = 5; k < 9; ++k) lie[frame + k] = '\x7f';  // height and width
  for (const std::string& bytes : {good.substr(0, good.size() / 2), good.substr(0, 20), lie,
                                   std::string("\xff\xd8\xff nothing")}) {
    const auto result = decode_image(bytes, "folder/7.jpg");
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
    EXPECT_EQ(std::string(result.error().what()).rfind("folder/7.jpg: not a JPEG", 0), 0u)
        << result.error().what();
  }
}

TEST(JpegRead, WhatIsNoJpegIsTakenForAPng) {
  EXPECT_TRUE(decode_image(encode_png(smooth(3)).value(), "x").ok());
  EXPECT_FALSE(decode_image("", "x").ok());
}

}  // namespace
}  // namespace sheaf
