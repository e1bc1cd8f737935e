// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/jpeg_write.h"

#include <csetjmp>
#include <cstdio>
#include <cstdlib>

// After <cstdio>, whose types it takes without including it.
#include <jpeglib.h>

namespace sheaf {
namespace {

/// What libjpeg's callbacks see.
struct Writing {
  jpeg_error_mgr errors{};
  jpeg_compress_struct jpeg{};
  std::jmp_buf back{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  ~Writing() {
    jpeg_destroy_compress(&jpeg);
    std::free(bytes);
  }
};

[[noreturn]] void take_error(j_common_ptr jpeg) {
  std::longjmp(static_cast<Writing*>(jpeg->client_data)->back, 1);
}

}  // namespace

std::string encode_grey_jpeg(const std::vector<std::uint8_t>& grey, int width, int height,
                             int quality) {
  if (width <= 0 || height <= 0 || grey.size() != std::size_t(width) * std::size_t(height))
    return "";
  Writing writing;
  writing.jpeg.err = jpeg_std_error(&writing.errors);
  writing.errors.error_exit = take_error;
  writing.errors.output_message = [](j_common_ptr) {};
  writing.jpeg.client_data = &writing;
  if (setjmp(writing.back) != 0) return "";
  jpeg_create_compress(&writing.jpeg);
  jpeg_mem_dest(&writing.jpeg, &writing.bytes, &writing.size);
  writing.jpeg.image_width = static_cast<JDIMENSION>(width);
  writing.jpeg.image_height = static_cast<JDIMENSION>(height);
  writing.jpeg.input_components = 1;
  writing.jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&writing.jpeg);
  jpeg_set_quality(&writing.jpeg, quality, TRUE);
  writing.jpeg.optimize_coding = TRUE;
  jpeg_start_compress(&writing.jpeg, TRUE);
  while (writing.jpeg.next_scanline < writing.jpeg.image_height) {
    auto* row =
        const_cast<JSAMPLE*>(&grey[std::size_t(writing.jpeg.next_scanline) * std::size_t(width)]);
    jpeg_write_scanlines(&writing.jpeg, &row, 1);
  }
  jpeg_finish_compress(&writing.jpeg);
  return {reinterpret_cast<const char*>(writing.bytes), writing.size};
}

}  // namespace sheaf
