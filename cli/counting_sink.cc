// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "counting_sink.h"

#include <fmt/format.h>

#include <utility>

namespace sheaf {

void CountingSink::counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) {
  images_ = images;
  points_ = points;
  observations_ = observations;
  track_.assign(points, 0);
  per_image_.assign(images, 0);
  focal_px_.reserve(images);
  file_.counts(images, points, observations);
}

void CountingSink::observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) {
  ++track_[point];
  ++per_image_[image];
  file_.observation(image, point, x_px, y_px);
}

void CountingSink::image(const std::array<double, 3>& angle_axis,
                         const std::array<double, 3>& translation,
                         const std::array<double, 3>& intrinsics) {
  focal_px_.push_back(intrinsics[0]);
  file_.image(angle_axis, translation, intrinsics);
}

Statistics CountingSink::statistics() const {
  std::map<std::uint64_t, std::uint64_t> histogram;
  for (const std::uint32_t length : track_) ++histogram[length];
  // The length of the point with so many shorter ones or equals before it.
  const auto length_at = [&](std::uint64_t rank) {
    std::uint64_t sum = 0;
    for (const auto& [length, points] : histogram)
      if ((sum += points) > rank) return static_cast<double>(length);
    return 0.0;
  };
  Statistics out;
  out.track_histogram.assign(histogram.begin(), histogram.end());
  out.track = {length_at(0), (length_at((points_ - 1) / 2) + length_at(points_ / 2)) / 2,
               length_at(points_ - 1)};
  out.mean_track = static_cast<double>(observations_) / static_cast<double>(points_);
  out.observations_per_image = range_of(per_image_);
  out.mean_observations_per_image =
      static_cast<double>(observations_) / static_cast<double>(images_);
  out.focal_px = range_of(focal_px_);
  return out;
}

Json CountingSink::totals_json() const {
  return {{"cameras", images_},
          {"poses", images_},
          {"points", points_},
          {"observations", observations_}};
}

std::string CountingSink::totals_text() const {
  return fmt::format("{} images, {} points, {} observations", images_, points_, observations_);
}

}  // namespace sheaf
