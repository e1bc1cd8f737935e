// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "image/jpeg.h"
#include "io/folder_files.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour kUnseen{150, 150, 150};

/// Where a point's colour is looked up.
struct Place {
  std::uint32_t point;
  double x, y;
};

/// By image.
std::vector<std::vector<Place>> places_of(const PhotometricProblem& problem,
                                          const std::vector<PatchSight>& seen) {
  std::vector<std::vector<Place>> places(problem.images.size());
  const auto points = static_cast<std::uint32_t>(problem.num_points());
  if (problem.has_hosts()) {
    for (std::uint32_t i = 0; i < points; ++i)
      places[problem.host[i]].push_back({i, problem.host_xy[2 * i], problem.host_xy[2 * i + 1]});
    return places;
  }
  std::vector<const PatchSight*> best(points, nullptr);
  for (const PatchSight& sight : seen) {
    const PatchSight*& now = best[sight.point];
    if (now == nullptr || sight.rms_grey < now->rms_grey) now = &sight;
  }
  for (std::uint32_t i = 0; i < points; ++i)
    if (best[i] != nullptr) places[best[i]->image].push_back({i, best[i]->x, best[i]->y});
  return places;
}

/// An image's samples: of its file, else its grey levels.
Result<Raster> raster_of(const PhotometricFolder& folder, std::size_t image) {
  if (image < folder.files.size()) {
    const Result<std::string> bytes = bytes_of(folder.files[image]);
    if (!bytes.ok()) return bytes.error();
    return decode_image(bytes.value(), folder.files[image].string());
  }
  const GreyImage& grey = folder.problem.images[image];
  Raster raster{grey.width, grey.height, 1, 8, {}};
  raster.samples.reserve(grey.pixels.size());
  for (float level : grey.pixels)
    raster.samples.push_back(
        static_cast<std::uint16_t>(std::lround(std::clamp(level, 0.0f, 255.0f))));
  return raster;
}

/// Bilinear; beyond the border as at it.
Colour colour_at(const Raster& raster, double x, double y) {
  const double u = std::clamp(x, 0.0, raster.width - 1.0),
               v = std::clamp(y, 0.0, raster.height - 1.0);
  const auto x0 = static_cast<std::size_t>(u), y0 = static_cast<std::size_t>(v);
  const std::size_t x1 = std::min(x0 + 1, std::size_t(raster.width) - 1);
  const std::size_t y1 = std::min(y0 + 1, std::size_t(raster.height) - 1);
  const double fx = u - static_cast<double>(x0), fy = v - static_cast<double>(y0);
  const auto channels = static_cast<std::size_t>(raster.channels);
  const double scale = raster.bits == 16 ? 255.0 / 65535.0 : 1.0;
  Colour out;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto at = [&](std::size_t column, std::size_t row) -> double {
      return raster
          .samples[channels * (row * std::size_t(raster.width) + column) + (channels == 1 ? 0 : c)];
    };
    const double top = (1 - fx) * at(x0, y0) + fx * at(x1, y0);
    const double bottom = (1 - fx) * at(x0, y1) + fx * at(x1, y1);
    out[c] = static_cast<std::uint8_t>(
        std::lround(std::clamp(scale * ((1 - fy) * top + fy * bottom), 0.0, 255.0)));
  }
  return out;
}

}  // namespace

Problem cloud_of(const PhotometricProblem& problem) {
  Problem out;
  const Pinhole& k = problem.camera;
  for (std::size_t j = 0; j < problem.poses.size(); ++j) {
    Camera camera{CameraModel::pinhole, {k.fx, k.fy, k.cx + 0.5, k.cy + 0.5}};
    if (j < problem.images.size()) {
      camera.width_px = static_cast<std::uint64_t>(problem.images[j].width);
      camera.height_px = static_cast<std::uint64_t>(problem.images[j].height);
    }
    out.add_image(problem.poses[j], camera);
  }
  out.points = problem.points;
  return out;
}

Result<Problem> coloured_cloud_of(const PhotometricFolder& folder,
                                  const std::vector<PatchSight>& seen) {
  auto metadata = std::make_shared<SceneMetadata>();
  metadata->point_colours.assign(folder.problem.num_points(), kUnseen);
  const auto places = places_of(folder.problem, seen);
  for (std::size_t j = 0; j < places.size(); ++j) {
    if (places[j].empty()) continue;
    const Result<Raster> raster = raster_of(folder, j);
    if (!raster.ok()) return raster.error();
    for (const Place& at : places[j])
      metadata->point_colours[at.point] = colour_at(raster.value(), at.x, at.y);
  }
  Problem out = cloud_of(folder.problem);
  out.metadata = std::move(metadata);
  return out;
}

}  // namespace sheaf
