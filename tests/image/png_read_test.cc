// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>

#include "image/png.h"

namespace sheaf {
namespace {

Raster checked(int channels, int bits) {
  Raster raster{31, 17, channels, bits, {}};
  for (int i = 0; i < 31 * 17 * channels; ++i)
    raster.samples.push_back(static_cast<std::uint16_t>(bits == 8 ? i * 7 % 256 : i * 641 % 65536));
  return raster;
}

TEST(PngRead, SamplesComeBackAsTheyWere) {
  for (int channels : {1, 3})
    for (int bits : {8, 16}) {
      const Raster before = checked(channels, bits);
      const Raster after = decode_png(encode_png(before).value(), "x.png").value();
      EXPECT_EQ(after.width, before.width);
      EXPECT_EQ(after.height, before.height);
      EXPECT_EQ(after.channels, channels);
      EXPECT_EQ(after.bits, bits);
      EXPECT_EQ(after.samples, before.samples) << channels << " channels of " << bits << " bits";
    }
}

TEST(PngRead, RefusesWhatIsNoImageByItsName) {
  const std::string good = encode_png(checked(3, 8)).value();
  std::string broken = good;
  broken[broken.size() / 2] = static_cast<char>(broken[broken.size() / 2] ^ 0x55);
  for (const std::string& bytes :
       {std::string(), std::string("GIF89a"), good.substr(0, good.size() / 2), broken}) {
    const auto result = decode_png(bytes, "folder/7.png");
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
    EXPECT_NE(std::string(result.error().what()).find("folder/7.png"), std::string::npos);
  }
}

TEST(PngRead, RefusesAHeaderThatPromisesTooMuch) {
  std::string lie = encode_png(checked(1, 8)).value();
  // Width and height stand at bytes 16 to 23; the checksum of the header no longer fits either.
  lie[16] = lie[20] = 0x40;
  EXPECT_FALSE(decode_png(lie, "x.png").ok());
}

}  // namespace
}  // namespace sheaf
