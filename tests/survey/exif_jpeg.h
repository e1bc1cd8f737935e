// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace sheaf::test {

/// A tag of a TIFF directory.
struct TiffTag {
  std::uint16_t tag, type;
  std::uint32_t count;
  std::string bytes;  ///< little-endian
};

inline std::string little(std::uint64_t value, int bytes) {
  std::string out;
  for (int k = 0; k < bytes; ++k) out += static_cast<char>(value >> (8 * k) & 0xff);
  return out;
}
inline std::string rational(double value, std::uint32_t denominator = 1000000) {
  return little(static_cast<std::uint64_t>(std::llround(value * denominator)), 4) +
         little(denominator, 4);
}
inline TiffTag letter(std::uint16_t tag, char c) { return {tag, 2, 2, std::string{c, '\0'}}; }
inline TiffTag one_number(std::uint16_t tag, double value) { return {tag, 5, 1, rational(value)}; }
inline TiffTag angle(std::uint16_t tag, double degrees) {
  const double whole = std::floor(degrees), minutes = std::floor(60 * (degrees - whole));
  return {tag, 5, 3,
          rational(whole, 1) + rational(minutes, 1) +
              rational(3600 * (degrees - whole - minutes / 60), 100000)};
}

/// The segments in front of a JPEG's image, with these tags in the GPS directory of its EXIF.
inline std::string exif_jpeg(const std::vector<TiffTag>& gps) {
  constexpr std::uint32_t kFirst = 8, kGps = kFirst + 2 + 12 + 4;
  std::string tiff = "II*" + std::string(1, '\0') + little(kFirst, 4);
  tiff += little(1, 2) + little(0x8825, 2) + little(4, 2) + little(1, 4) + little(kGps, 4);
  tiff += little(0, 4) + little(gps.size(), 2);
  std::string values;
  const std::size_t behind = kGps + 2 + 12 * gps.size() + 4;
  for (const TiffTag& tag : gps) {
    tiff += little(tag.tag, 2) + little(tag.type, 2) + little(tag.count, 4);
    if (tag.bytes.size() <= 4) {
      tiff += tag.bytes + std::string(4 - tag.bytes.size(), '\0');
    } else {
      tiff += little(behind + values.size(), 4);
      values += tag.bytes;
    }
  }
  tiff += little(0, 4) + values;
  const std::string block = std::string("Exif\0\0", 6) + tiff;
  const auto segment = [](char marker, const std::string& bytes) {
    const std::size_t size = bytes.size() + 2;
    return std::string{'\xff', marker, static_cast<char>(size >> 8), static_cast<char>(size)} +
           bytes;
  };
  return "\xff\xd8" + segment('\xe0', std::string("JFIF\0\1\2\0\0\1\0\1\0\0", 14)) +
         segment('\xe1', "http://ns.adobe.com/xap/1.0/") + segment('\xe1', block) + "\xff\xd9";
}

/// North or south by its sign, and so on; heights below the sea too.
inline std::string exif_jpeg(double latitude, double longitude, double height) {
  return exif_jpeg({letter(1, latitude < 0 ? 'S' : 'N'),
                    angle(2, std::abs(latitude)),
                    letter(3, longitude < 0 ? 'W' : 'E'),
                    angle(4, std::abs(longitude)),
                    {5, 1, 1, std::string(1, height < 0 ? '\1' : '\0')},
                    one_number(6, std::abs(height))});
}

}  // namespace sheaf::test
