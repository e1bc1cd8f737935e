// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <system_error>

#include "io/byte_source.h"
#include "survey/constraint_files.h"
#include "survey/exif_gps.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

// What a receiver without corrections reaches under open sky, metres.
constexpr double kHorizontalSigma = 5, kVerticalSigma = 10;
constexpr std::size_t kMostNamed = 5;

/// Walks over the segments in front of a JPEG's image; what is not needed is read and dropped.
class Segments {
 public:
  explicit Segments(RawBytes bytes) : bytes_(std::move(bytes)) {}

  /// The first APP1 segment that begins with "Exif"; empty where there is none.
  std::string exif() {
    constexpr int kStart = 0xd8, kApp1 = 0xe1, kScan = 0xda, kEnd = 0xd9;
    if (byte() != 0xff || byte() != kStart) return "";
    while (bytes_.bytes_read() < kMostBytes) {
      if (byte() != 0xff) return "";
      int marker = byte();
      while (marker == 0xff) marker = byte();
      if (marker <= 0 || marker == kScan || marker == kEnd) return "";
      const int high = byte(), low = byte();
      const int length = 256 * high + low - 2;
      if (high < 0 || low < 0 || length < 0) return "";
      std::string segment = take(static_cast<std::size_t>(length));
      if (marker == kApp1 && segment.starts_with(std::string("Exif\0\0", 6))) return segment;
    }
    return "";
  }

 private:
  static constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 20;

  /// -1 at the end.
  int byte() {
    const std::string one = take(1);
    return one.empty() ? -1 : static_cast<unsigned char>(one[0]);
  }
  std::string take(std::size_t count) {
    std::string out(count, '\0');
    const Result<std::size_t> got = bytes_.read(out.data(), count);
    out.resize(got.ok() ? got.value() : 0);
    return out;
  }
  RawBytes bytes_;
};

ExifGps gps_of(const fs::path& image) {
  Result<RawBytes> bytes = RawBytes::open_regular(image);
  if (!bytes.ok()) return {{}, bytes.error().what()};
  const std::string block = Segments(std::move(bytes).value()).exif();
  if (block.empty()) return {{}, "it has no EXIF"};
  return exif_gps(block);
}

bool is_jpeg(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".jpg" || extension == ".jpeg";
}

/// Relative to the folder, sorted.
Result<std::vector<std::string>> images_in(const fs::path& folder) {
  std::vector<std::string> out;
  std::error_code error;
  fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    std::error_code ignored;
    if (is_jpeg(at->path()) && at->is_regular_file(ignored))
      out.push_back(at->path().lexically_relative(folder).generic_string());
  }
  if (error)
    return Error(ErrorCode::unreadable_input,
                 folder.string() + ": cannot be read: " + error.message());
  std::sort(out.begin(), out.end());
  return out;
}

ImagePosition position_of(const std::string& image, const ExifPosition& gps) {
  ImagePosition out;
  out.image = image;
  out.at = {gps.latitude, gps.longitude, gps.height.value_or(0)};
  const double across = gps.horizontal_error.value_or(kHorizontalSigma);
  const double up = gps.height ? kVerticalSigma : kUnknownHeightSigma;
  out.covariance = {across * across, 0, 0, 0, across * across, 0, 0, 0, up * up};
  return out;
}

/// "a.jpg: it has no EXIF; b.jpg: ...; and 7 more".
std::string listed(const std::vector<std::string>& without) {
  std::string out;
  for (std::size_t i = 0; i < std::min(without.size(), kMostNamed); ++i)
    out += (i == 0 ? "" : "; ") + without[i];
  if (without.size() > kMostNamed)
    out += "; and " + std::to_string(without.size() - kMostNamed) + " more";
  return out;
}

}  // namespace

Result<Constraints> read_image_positions(const fs::path& path) {
  std::error_code ignored;
  const bool is_folder = fs::is_directory(path, ignored);
  std::vector<std::string> names = {path.filename().string()};
  if (is_folder) {
    Result<std::vector<std::string>> found = images_in(path);
    if (!found.ok()) return found.error();
    names = std::move(found).value();
  }
  if (names.empty())
    return Error(ErrorCode::unreadable_input,
                 path.string() + ": found no .jpg or .jpeg in the folder, expected images");
  Constraints out;
  out.paths = {path.string()};
  out.frame = {WorldKind::geodetic, "WGS84", {}};
  std::vector<std::string> without;
  for (const std::string& name : names) {
    const ExifGps gps = gps_of(is_folder ? path / name : path);
    if (gps.position) {
      out.positions.push_back(position_of(name, *gps.position));
    } else {
      without.push_back(name + ": " + gps.why_not);
    }
  }
  if (out.positions.empty())
    return Error(ErrorCode::unreadable_input,
                 path.string() + ": found no image with a GPS position, expected one at least (" +
                     listed(without) + ")");
  if (!without.empty())
    out.notes.push_back(std::to_string(without.size()) + " of " + std::to_string(names.size()) +
                        " images in " + path.string() + " give no position: " + listed(without));
  return out;
}

}  // namespace sheaf
