// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/exif_gps.h"

#include <libexif/exif-data.h>

#include <cmath>
#include <memory>

namespace sheaf {
namespace {

// Not in all versions of the library's header.
constexpr auto kHorizontalError = static_cast<ExifTag>(0x001f);

struct Release {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};

/// The tags of the GPS directory.
class GpsTags {
 public:
  explicit GpsTags(std::string_view block) : data_(exif_data_new()) {
    // As the file has it: what does not follow the specification is not mended.
    exif_data_unset_option(data_.get(), EXIF_DATA_OPTION_IGNORE_UNKNOWN_TAGS);
    exif_data_unset_option(data_.get(), EXIF_DATA_OPTION_FOLLOW_SPECIFICATION);
    exif_data_load_data(data_.get(), reinterpret_cast<const unsigned char*>(block.data()),
                        static_cast<unsigned>(block.size()));
  }

  /// The number at a place of a tag; nothing where it is missing, of another kind, or n / 0.
  std::optional<double> number(ExifTag tag, unsigned at = 0) const {
    constexpr unsigned kBytes = 8;
    const ExifEntry* entry = find(tag);
    if (entry == nullptr || entry->data == nullptr || entry->size < kBytes * (at + 1)) return {};
    const unsigned char* bytes = entry->data + std::size_t{kBytes} * at;
    const ExifByteOrder order = exif_data_get_byte_order(data_.get());
    double value = NAN;
    if (entry->format == EXIF_FORMAT_RATIONAL) {
      const ExifRational r = exif_get_rational(bytes, order);
      value = static_cast<double>(r.numerator) / static_cast<double>(r.denominator);
    } else if (entry->format == EXIF_FORMAT_SRATIONAL) {
      const ExifSRational r = exif_get_srational(bytes, order);
      value = static_cast<double>(r.numerator) / static_cast<double>(r.denominator);
    }
    return std::isfinite(value) ? std::optional(value) : std::nullopt;
  }

  /// The first byte of a tag, or `otherwise`.
  unsigned char byte(ExifTag tag, unsigned char otherwise) const {
    const ExifEntry* entry = find(tag);
    return entry == nullptr || entry->data == nullptr || entry->size < 1 ? otherwise
                                                                         : entry->data[0];
  }

  /// Degrees, minutes and seconds; nothing where there are no degrees.
  std::optional<double> angle(ExifTag tag) const {
    const std::optional<double> degrees = number(tag, 0);
    if (!degrees) return {};
    return *degrees + number(tag, 1).value_or(0) / 60 + number(tag, 2).value_or(0) / 3600;
  }

 private:
  const ExifEntry* find(ExifTag tag) const {
    const ExifContent* gps = data_->ifd[EXIF_IFD_GPS];
    return gps == nullptr ? nullptr : exif_content_get_entry(const_cast<ExifContent*>(gps), tag);
  }
  std::unique_ptr<ExifData, Release> data_;
};

/// The angle, negative where the reference is `negative`; nothing where it is neither of the two.
std::optional<double> signed_angle(double angle, unsigned char reference, char positive,
                                   char negative) {
  if (reference == static_cast<unsigned char>(positive)) return angle;
  if (reference == static_cast<unsigned char>(negative)) return -angle;
  return {};
}

/// 0 and 2 are above sea level and the ellipsoid, 1 and 3 below; some write them as digits.
double height_of(double height, unsigned char reference) {
  return reference == 1 || reference == 3 || reference == '1' || reference == '3' ? -height
                                                                                  : height;
}

}  // namespace

ExifGps exif_gps(std::string_view block) {
  const GpsTags tags(block);
  const auto latitude = tags.angle(static_cast<ExifTag>(EXIF_TAG_GPS_LATITUDE));
  const auto longitude = tags.angle(static_cast<ExifTag>(EXIF_TAG_GPS_LONGITUDE));
  if (!latitude || !longitude) return {{}, "it has no GPS position"};
  // What cameras write that have not found their place.
  if (*latitude == 0 && *longitude == 0) return {{}, "its latitude and longitude are 0"};
  const auto north = signed_angle(
      *latitude, tags.byte(static_cast<ExifTag>(EXIF_TAG_GPS_LATITUDE_REF), 'N'), 'N', 'S');
  const auto east = signed_angle(
      *longitude, tags.byte(static_cast<ExifTag>(EXIF_TAG_GPS_LONGITUDE_REF), 'E'), 'E', 'W');
  if (!north || !east) return {{}, "its latitude or longitude is of no direction N, S, E or W"};
  if (std::abs(*north) > 90 || std::abs(*east) > 180)
    return {{}, "its latitude or longitude is out of range"};
  ExifPosition out{*north, *east, {}, {}};
  if (const auto height = tags.number(static_cast<ExifTag>(EXIF_TAG_GPS_ALTITUDE)))
    out.height = height_of(*height, tags.byte(static_cast<ExifTag>(EXIF_TAG_GPS_ALTITUDE_REF), 0));
  const auto error = tags.number(kHorizontalError);
  if (error && *error > 0) out.horizontal_error = error;
  return {out, ""};
}

}  // namespace sheaf
