// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "image/jpeg.h"
#include "image/pgm.h"
#include "image/png.h"

// After <cstdio>, whose types it takes without including it.
#include <jerror.h>
#include <jpeglib.h>

namespace sheaf {
namespace {

/// What libjpeg's callbacks see.
struct Reading {
  jpeg_error_mgr errors{};
  jpeg_decompress_struct jpeg{};
  std::jmp_buf back{};
  char message[JMSG_LENGTH_MAX] = "";
  jpeg_progress_mgr progress{};
  const ImageBounds* bounds = nullptr;
  std::string refusal;
  std::vector<JSAMPLE> samples;
  ~Reading() { jpeg_destroy_decompress(&jpeg); }
};

Reading& reading_of(j_common_ptr jpeg) { return *static_cast<Reading*>(jpeg->client_data); }

[[noreturn]] void take_error(j_common_ptr jpeg) {
  Reading& reading = reading_of(jpeg);
  reading.errors.format_message(jpeg, reading.message);
  std::longjmp(reading.back, 1);
}

/// Warnings of missing data are errors: libjpeg would fill in grey.
void take_warning(j_common_ptr jpeg, int level) {
  const int code = jpeg->err->msg_code;
  if (level < 0 && (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER)) take_error(jpeg);
}

/// Each scan of a progressive image costs a pass over all of it: those of encoders have ten or so.
void count_scans(j_common_ptr common) {
  constexpr int kMostScans = 100;
  if (reinterpret_cast<j_decompress_ptr>(common)->input_scan_number <= kMostScans) return;
  Reading& reading = reading_of(common);
  std::snprintf(reading.message, sizeof reading.message, "more than %d scans", kMostScans);
  std::longjmp(reading.back, 1);
}

/// A JPEG of one colour takes little more than a bit for 64 pixels: larger images are lies, not
/// worth their memory.
bool can_hold(std::size_t file_bytes, const jpeg_decompress_struct& jpeg) {
  return std::size_t(jpeg.image_width) * jpeg.image_height <= 1000 * file_bytes + 65536;
}

/// libjpeg leaves errors by a long jump to here: nothing in this function has a destructor.
bool read_samples(Reading& reading, const unsigned char* bytes, std::size_t size) {
  jpeg_decompress_struct& jpeg = reading.jpeg;
  jpeg.err = jpeg_std_error(&reading.errors);
  jpeg.client_data = &reading;
  reading.errors.error_exit = take_error;
  reading.errors.emit_message = take_warning;
  if (setjmp(reading.back)) return false;
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, bytes, static_cast<unsigned long>(size));
  jpeg_read_header(&jpeg, TRUE);
  if (!can_hold(size, jpeg)) ERREXIT(&jpeg, JERR_INPUT_EOF);
  reading.refusal = reading.bounds->refusal(jpeg.image_width, jpeg.image_height, size);
  if (!reading.refusal.empty()) return false;
  reading.progress.progress_monitor = count_scans;
  jpeg.progress = &reading.progress;
  jpeg.out_color_space = jpeg.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&jpeg);
  const std::size_t row =
      std::size_t(jpeg.output_width) * static_cast<std::size_t>(jpeg.output_components);
  reading.samples.resize(row * jpeg.output_height);
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW to = &reading.samples[row * jpeg.output_scanline];
    jpeg_read_scanlines(&jpeg, &to, 1);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

}  // namespace

Result<Raster> decode_jpeg(std::string_view bytes, const std::string& name,
                           const ImageBounds& bounds) {
  Reading reading;
  reading.bounds = &bounds;
  if (!read_samples(reading, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()))
    return Error(ErrorCode::unreadable_input,
                 name + ": " +
                     (reading.refusal.empty()
                          ? std::string("not a JPEG image that can be read: ") + reading.message
                          : reading.refusal));
  Raster out;
  out.width = static_cast<int>(reading.jpeg.output_width);
  out.height = static_cast<int>(reading.jpeg.output_height);
  out.channels = reading.jpeg.output_components;
  out.samples.assign(reading.samples.begin(), reading.samples.end());
  return out;
}

Result<Raster> decode_image(std::string_view bytes, const std::string& name,
                            const ImageBounds& bounds) {
  if (bytes.starts_with("\xff\xd8\xff")) return decode_jpeg(bytes, name, bounds);
  if (bytes.starts_with(kPgmMark)) return decode_pgm(bytes, name, bounds);
  return decode_png(bytes, name, bounds);
}

}  // namespace sheaf
