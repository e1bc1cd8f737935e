// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/thumbnails.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "image/jpeg.h"
#include "image/jpeg_write.h"
#include "io/folder_files.h"
#include "platform/base64.h"
#include "platform/parallel.h"

namespace sheaf {
namespace {

constexpr std::size_t kLarge = 12, kMost = 300;
constexpr int kLarge_px = 400, kSmall_px = 140, kLargeQuality = 55, kSmallQuality = 50;

/// Each pixel the mean of those that it covers.
std::vector<std::uint8_t> shrunk(const Raster& raster, int width, int height) {
  const std::vector<float> grey = grey_of(raster);
  std::vector<std::uint8_t> out(std::size_t(width) * std::size_t(height));
  const auto edge = [](int k, int small, int large) {
    return static_cast<int>(std::int64_t(k) * large / small);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int x0 = edge(x, width, raster.width), y0 = edge(y, height, raster.height);
      const int x1 = std::max(x0 + 1, edge(x + 1, width, raster.width));
      const int y1 = std::max(y0 + 1, edge(y + 1, height, raster.height));
      double sum = 0;
      for (int v = y0; v < y1; ++v)
        for (int u = x0; u < x1; ++u)
          sum += grey[std::size_t(v) * std::size_t(raster.width) + std::size_t(u)];
      const double most = raster.bits > 8 ? 257 : 1;
      out[std::size_t(y) * std::size_t(width) + std::size_t(x)] = static_cast<std::uint8_t>(
          std::clamp(sum / double(x1 - x0) / double(y1 - y0) / most + 0.5, 0.0, 255.0));
    }
  return out;
}

std::string encoded(const Raster& of, int longest, int quality) {
  const double scale = std::min(1.0, double(longest) / std::max(of.width, of.height));
  const int width = std::max(1, static_cast<int>(std::lround(of.width * scale)));
  const int height = std::max(1, static_cast<int>(std::lround(of.height * scale)));
  return base64(encode_grey_jpeg(shrunk(of, width, height), width, height, quality));
}

std::string thumbnail(const std::filesystem::path& path, int longest, int quality) {
  const Result<std::string> bytes = bytes_of(path);
  if (!bytes.ok()) return "";
  const Result<Raster> raster = decode_image(bytes.value(), path.string());
  if (!raster.ok()) return "";
  return encoded(raster.value(), longest, quality);
}

std::filesystem::path found(const std::filesystem::path& folder, const std::string& name) {
  std::error_code ignored;
  const std::filesystem::path relative(name);
  for (const std::filesystem::path& path : {folder / relative, folder / relative.filename()})
    if (!name.empty() && std::filesystem::is_regular_file(path, ignored)) return path;
  return {};
}

}  // namespace

std::string grey_thumbnail(const GreyImage& grey) {
  if (grey.width <= 0 || grey.height <= 0) return "";
  Raster raster;
  raster.width = grey.width;
  raster.height = grey.height;
  for (const float level : grey.pixels)
    raster.samples.push_back(static_cast<std::uint16_t>(std::clamp(level + 0.5f, 0.0f, 255.0f)));
  return encoded(raster, kLarge_px, kLargeQuality);
}

Thumbnails thumbnails(const PageScene& scene, const Problem& named,
                      const std::filesystem::path& folder, int threads) {
  const SceneMetadata* known = named.metadata.get();
  if (folder.empty() || known == nullptr || known->image_names.empty()) return {};
  const std::size_t count = std::min(kMost, scene.worst.size());
  std::vector<std::string> made(count);
  Threads(threads).for_each(count, [&](std::size_t k) {
    const std::filesystem::path path = found(folder, known->image_names[scene.worst[k]]);
    if (path.empty()) return;
    const bool large = k < kLarge || count <= 2 * kLarge;
    made[k] = thumbnail(path, large ? kLarge_px : kSmall_px, large ? kLargeQuality : kSmallQuality);
  });
  Thumbnails out;
  for (std::size_t k = 0; k < count; ++k)
    if (!made[k].empty()) out[scene.worst[k]] = std::move(made[k]);
  return out;
}

}  // namespace sheaf
