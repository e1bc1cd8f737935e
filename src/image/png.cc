// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/png.h"

#include <png.h>

#include <cstdint>
#include <vector>

namespace sheaf {

Result<std::string> encode_png(const Image& image) {
  // The simplified interface: errors come back as values, without setjmp.
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  std::string bytes;
  png_alloc_size_t size = 0;
  if (image.width > 0 && image.height > 0) size = PNG_IMAGE_PNG_SIZE_MAX(png);
  bytes.resize(size);
  if (size == 0 ||
      png_image_write_to_memory(&png, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr) == 0)
    return Error(ErrorCode::unwritable_output, std::string("the image cannot be made a PNG: ") +
                                                   (size == 0 ? "it has no pixels" : png.message));
  bytes.resize(size);
  return bytes;
}

}  // namespace sheaf
