// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/png.h"

#include <png.h>

#include <cstdint>
#include <vector>

namespace sheaf {
namespace {

/// The simplified interface: errors come back as values, without setjmp.
Result<std::string> encode(int width, int height, std::uint32_t format, const void* samples) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(width);
  png.height = static_cast<png_uint_32>(height);
  png.format = format;
  std::string bytes;
  png_alloc_size_t size = 0;
  if (width > 0 && height > 0) size = PNG_IMAGE_PNG_SIZE_MAX(png);
  bytes.resize(size);
  if (size == 0 ||
      png_image_write_to_memory(&png, bytes.data(), &size, 0, samples, 0, nullptr) == 0)
    return Error(ErrorCode::unwritable_output, std::string("the image cannot be made a PNG: ") +
                                                   (size == 0 ? "it has no pixels" : png.message));
  bytes.resize(size);
  return bytes;
}

}  // namespace

Result<std::string> encode_png(const Image& image) {
  return encode(image.width, image.height, PNG_FORMAT_RGB, image.rgb.data());
}

Result<std::string> encode_png(const Raster& raster) {
  const bool grey = raster.channels == 1;
  if (raster.bits == 16)
    return encode(raster.width, raster.height, grey ? PNG_FORMAT_LINEAR_Y : PNG_FORMAT_LINEAR_RGB,
                  raster.samples.data());
  const std::vector<std::uint8_t> samples(raster.samples.begin(), raster.samples.end());
  return encode(raster.width, raster.height, grey ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB,
                samples.data());
}

}  // namespace sheaf
