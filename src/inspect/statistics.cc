// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/statistics.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "geometry/camera_model.h"
#include "scene/point_errors.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

std::vector<double> occurrences(const std::vector<std::uint32_t>& ids, std::size_t size) {
  std::vector<double> counts(size, 0);
  for (const std::uint32_t id : ids) ++counts[id];
  return counts;
}

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.size() * sizeof(T);
}

}  // namespace

Range range_of(std::vector<double> values) {
  if (values.empty()) return {};
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  Range out{*least, 0, *most};
  // The upper of the two in the middle; of an even number the lower is the largest before it.
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double lower = values.size() % 2 == 1 ? *middle : *std::max_element(values.begin(), middle);
  out.median = (lower + *middle) / 2;
  return out;
}

Statistics statistics_of(const Problem& problem) {
  Statistics out;
  const std::vector<double> tracks = occurrences(problem.observation_point, problem.num_points());
  std::map<std::uint64_t, std::uint64_t> histogram;
  for (const double length : tracks) ++histogram[static_cast<std::uint64_t>(length)];
  out.track_histogram.assign(histogram.begin(), histogram.end());
  out.track = range_of(tracks);
  if (problem.num_points() > 0)
    out.mean_track =
        static_cast<double>(problem.num_observations()) / static_cast<double>(problem.num_points());
  out.observations_per_image =
      range_of(occurrences(problem.observation_image, problem.num_images()));
  if (problem.num_images() > 0)
    out.mean_observations_per_image =
        static_cast<double>(problem.num_observations()) / static_cast<double>(problem.num_images());
  std::vector<double> focal;
  for (const Camera& camera : problem.cameras) focal.push_back(pixels_per_radian(camera));
  out.focal_px = range_of(std::move(focal));
  double sum = 0;
  std::size_t known = 0;
  for (const double error : mean_point_errors(problem))
    if (error >= 0) sum += error, ++known;
  if (known > 0) out.mean_error_px = sum / static_cast<double>(known);
  return out;
}

std::vector<CameraStatistics> camera_statistics(const Problem& problem) {
  std::vector<CameraStatistics> out(problem.cameras.size());
  std::vector<std::uint64_t> finite(out.size(), 0);
  for (const std::uint32_t camera : problem.image_camera) ++out[camera].images;
  const std::vector<double> lengths = residual_lengths(problem);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const std::uint32_t camera = problem.image_camera[problem.observation_image[i]];
    ++out[camera].observations;
    if (!std::isfinite(lengths[i])) continue;
    out[camera].mean_error_px += lengths[i];
    ++finite[camera];
  }
  for (std::size_t c = 0; c < out.size(); ++c)
    if (finite[c] > 0) out[c].mean_error_px /= static_cast<double>(finite[c]);
  return out;
}

RigCounts rig_counts(const Problem& problem) {
  const Rigs& rigs = problem.rigs;
  RigCounts out{rigs.count, rigs.num_frames(), rigs.num_sensors()};
  if (rigs.empty()) return out;
  for (std::size_t j = 0; j < problem.num_images(); ++j) out.images += in_rig(rigs, j) ? 1 : 0;
  for (const std::uint8_t trivial : trivial_frames(rigs)) out.rigid_frames += trivial == 0 ? 1 : 0;
  return out;
}

std::uint64_t size_bytes(const Problem& p) {
  const std::uint64_t arrays = bytes_of(p.poses) + bytes_of(p.image_camera) + bytes_of(p.cameras) +
                               bytes_of(p.points) + bytes_of(p.observation_image) +
                               bytes_of(p.observation_point) + bytes_of(p.observation_xy) +
                               bytes_of(p.bal_angle_axis) + bytes_of(p.observation_sigma) +
                               bytes_of(p.rigs.sensor_from_rig) + bytes_of(p.rigs.rig_from_world) +
                               bytes_of(p.rigs.image_frame) + bytes_of(p.rigs.image_sensor);
  if (p.metadata == nullptr) return arrays;
  const SceneMetadata& m = *p.metadata;
  return arrays + bytes_of(m.camera_ids) + bytes_of(m.image_ids) + bytes_of(m.image_names) +
         bytes_of(m.point_ids) + bytes_of(m.point_colours) + bytes_of(m.point_errors_px) +
         bytes_of(m.observation_feature) + bytes_of(m.feature_begin) + bytes_of(m.feature_xy) +
         bytes_of(m.stated_rotations);
}

}  // namespace sheaf
