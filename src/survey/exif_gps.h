// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace sheaf {

/// Where a camera says that it was.
struct ExifPosition {
  double latitude = 0, longitude = 0;      ///< degrees, WGS84
  std::optional<double> height;            ///< metres, below sea level where negative
  std::optional<double> horizontal_error;  ///< metres
};

struct ExifGps {
  std::optional<ExifPosition> position;
  std::string why_not;  ///< "it has no GPS tags"; empty with a position
};

/// The GPS tags of an EXIF block: "Exif", two zeros and a TIFF, as an APP1 segment of a JPEG has
/// it.
ExifGps exif_gps(std::string_view block);

}  // namespace sheaf
