// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <png.h>

#include <csetjmp>
#include <cstdint>
#include <vector>

#include "image/png.h"

namespace sheaf {
namespace {

/// What libpng's callbacks see; ends the reading whichever way it went.
struct Reading {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string_view rest;
  std::string message;
  const ImageBounds* bounds = nullptr;
  std::string refusal;
  std::vector<png_byte> bytes;
  std::vector<png_bytep> rows;
  ~Reading() { png_destroy_read_struct(&png, &info, nullptr); }
};

void read_bytes(png_structp png, png_bytep to, std::size_t count) {
  auto& reading = *static_cast<Reading*>(png_get_io_ptr(png));
  if (count > reading.rest.size()) png_error(png, "the file ends too early");
  reading.rest.copy(reinterpret_cast<char*>(to), count);
  reading.rest.remove_prefix(count);
}

[[noreturn]] void take_error(png_structp png, png_const_charp message) {
  static_cast<Reading*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// Palettes and odd depths become plain 8 or 16 bits, as samples of this machine's byte order.
void ask_for_plain_samples(png_structp png, png_infop info) {
  png_set_palette_to_rgb(png);
  if (png_get_bit_depth(png, info) < 8) png_set_expand_gray_1_2_4_to_8(png);
  png_set_strip_alpha(png);
  (void)png_set_interlace_handling(png);
  png_read_update_info(png, info);
}

/// Deflate shrinks no more than about 1032 times: larger images are lies, not worth their memory.
bool can_hold(std::size_t file_bytes, std::size_t row_bytes, std::size_t height) {
  constexpr std::size_t kLargest = std::size_t(1) << 32;
  return row_bytes <= kLargest / height && row_bytes * height <= 1100 * file_bytes + 65536;
}

/// libpng leaves errors by a long jump to here: nothing in this function has a destructor.
bool read_samples(Reading& reading, std::size_t file_bytes, Raster& out) {
  if (setjmp(png_jmpbuf(reading.png))) return false;
  png_set_read_fn(reading.png, &reading, read_bytes);
  png_read_info(reading.png, reading.info);
  ask_for_plain_samples(reading.png, reading.info);
  out.width = static_cast<int>(png_get_image_width(reading.png, reading.info));
  out.height = static_cast<int>(png_get_image_height(reading.png, reading.info));
  out.channels = png_get_channels(reading.png, reading.info);
  out.bits = png_get_bit_depth(reading.png, reading.info);
  reading.refusal =
      reading.bounds->refusal(png_get_image_width(reading.png, reading.info),
                              png_get_image_height(reading.png, reading.info), file_bytes);
  if (!reading.refusal.empty()) return false;
  const std::size_t row_bytes = png_get_rowbytes(reading.png, reading.info);
  const auto height = static_cast<std::size_t>(out.height);
  if (!can_hold(file_bytes, row_bytes, height)) png_error(reading.png, "the file is too short");
  reading.bytes.resize(row_bytes * height);
  reading.rows.resize(height);
  for (std::size_t y = 0; y < height; ++y) reading.rows[y] = &reading.bytes[y * row_bytes];
  png_read_image(reading.png, reading.rows.data());
  png_read_end(reading.png, nullptr);
  return true;
}

void copy_samples(const std::vector<png_byte>& bytes, Raster& out) {
  const bool wide = out.bits == 16;
  out.samples.resize(bytes.size() / (wide ? 2 : 1));
  for (std::size_t i = 0; i < out.samples.size(); ++i)
    out.samples[i] =
        static_cast<std::uint16_t>(wide ? bytes[2 * i] << 8 | bytes[2 * i + 1] : bytes[i]);
}

}  // namespace

Result<Raster> decode_png(std::string_view bytes, const std::string& name,
                          const ImageBounds& bounds) {
  const auto unreadable = [&](const std::string& why) {
    return Error(ErrorCode::unreadable_input, name + ": not a PNG image that can be read: " + why);
  };
  Reading reading;
  reading.rest = bytes;
  reading.bounds = &bounds;
  reading.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reading, take_error, ignore_warning);
  if (reading.png == nullptr) return unreadable("libpng cannot be used");
  reading.info = png_create_info_struct(reading.png);
  if (reading.info == nullptr) return unreadable("libpng has no memory");
  Raster out;
  if (!read_samples(reading, bytes.size(), out))
    return reading.refusal.empty()
               ? unreadable(reading.message)
               : Error(ErrorCode::unreadable_input, name + ": " + reading.refusal);
  if (out.channels != 1 && out.channels != 3)
    return unreadable(std::to_string(out.channels) + " channels, expected 1 or 3");
  copy_samples(reading.bytes, out);
  return out;
}

}  // namespace sheaf
