// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <jpeglib.h>
#include <zlib.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "image/jpeg.h"
#include "image/png.h"

namespace sheaf {
namespace {

/// A PNG whose header states this size, with a checksum that fits, and whose file has this many
/// bytes.
std::string png_that_states(std::uint32_t width, std::uint32_t height, std::size_t bytes) {
  std::string png = encode_png(Raster{2, 2, 1, 8, {0, 0, 0, 0}}).value();
  const auto put = [&](std::size_t at, std::uint32_t word) {
    for (int k = 0; k < 4; ++k) png[at + k] = static_cast<char>(word >> (24 - 8 * k));
  };
  put(16, width), put(20, height);
  put(29,
      static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(png.data() + 12), 17)));
  png.resize(std::max(png.size(), bytes));
  return png;
}

/// A grey progressive JPEG whose every coefficient is two scans: 127 with that of the means.
std::string jpeg_of_scans() {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = jpeg.image_height = 16;
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  std::vector<jpeg_scan_info> scans{{1, {0, 0, 0, 0}, 0, 0, 0, 0}};
  for (int k = 1; k < 64; ++k) scans.push_back({1, {0, 0, 0, 0}, k, k, 0, 1});
  for (int k = 1; k < 64; ++k) scans.push_back({1, {0, 0, 0, 0}, k, k, 1, 0});
  jpeg.scan_info = scans.data();
  jpeg.num_scans = static_cast<int>(scans.size());
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<JSAMPLE> samples(16, 77);
  JSAMPROW row = samples.data();
  while (jpeg.next_scanline < jpeg.image_height) jpeg_write_scanlines(&jpeg, &row, 1);
  jpeg_finish_compress(&jpeg);
  std::string out(reinterpret_cast<char*>(memory), size);
  jpeg_destroy_compress(&jpeg);
  std::free(memory);
  return out;
}

void expect_refused(const Result<Raster>& image, const std::string& words) {
  ASSERT_FALSE(image.ok());
  EXPECT_EQ(image.error().code(), ErrorCode::unreadable_input);
  EXPECT_NE(std::string(image.error().what()).find(words), std::string::npos)
      << image.error().what();
}

// Each of them would take gigabytes before the first pixel is seen.
TEST(ImageBounds, AreHeldBeforeAnythingIsDecoded) {
  expect_refused(decode_image(png_that_states(20000, 20000, 400000), "x"), "20000 x 20000 pixels");
  expect_refused(decode_image(png_that_states(8000, 8000, 400000), "x"), "expected a byte for");
  expect_refused(decode_image(png_that_states(600000, 600, 1 << 20), "x"), "expected at most");
  expect_refused(decode_image(png_that_states(640, 480, 1000), "x", {1000, 480, "its camera's"}),
                 "found 640 x 480 pixels, expected its camera's 1000 x 480");
  const std::string small = encode_png(Raster{2, 2, 1, 8, {1, 2, 3, 4}}).value();
  EXPECT_TRUE(decode_image(small, "x", {2, 2, "its camera's"}).ok());
}

TEST(ImageBounds, ScansOfAProgressiveJpegAreCounted) {
  expect_refused(decode_image(jpeg_of_scans(), "x"), "more than 100 scans");
  expect_refused(decode_image(jpeg_of_scans(), "x", {16, 8, "its camera's"}), "16 x 16 pixels");
}

}  // namespace
}  // namespace sheaf
