// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "geometry/rotation.h"
#include "platform/random.h"
#include "scene/lakeside.h"
#include "scene/portable_rotation.h"
#include "scene/scene_checks.h"
#include "scene/track_lengths.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kFewestObservations = 10;  // per image, where the counts allow it

// Streams of the seed: another amount of one noise leaves everything else as it is.
enum Stream : std::uint64_t { kTracks = 2, kLengths = 3, kPixels = 4, kCameras = 5, kPoints = 6 };

// Which images see which point: point i has images[begin[i]] ... images[begin[i + 1]), ascending.
struct Tracks {
  std::vector<double> points;
  std::vector<std::uint64_t> begin{0};
  std::vector<std::uint32_t> images;
};

// `length` of the `count` images from `first` on, each choice equally likely.
void choose_images(std::uint32_t first, std::uint32_t count, std::uint32_t length,
                   std::uint32_t images, Random& random, std::vector<std::uint32_t>& out) {
  out.clear();
  for (std::uint32_t k = 0; k < count && out.size() < length; ++k) {
    if (random.below(count - k) < length - out.size()) {
      const std::uint64_t image = std::uint64_t{first} + k;
      out.push_back(static_cast<std::uint32_t>(image < images ? image : image - images));
    }
  }
  std::sort(out.begin(), out.end());
}

// The centres of the tracks walk once along the shore, so that images share them evenly.
Tracks make_tracks(const SceneOptions& options, const Lakeside& lakeside) {
  const auto images = static_cast<std::uint32_t>(options.images);
  Random length_random(options.seed, kLengths);
  const std::vector<std::uint32_t> lengths =
      draw_track_lengths(options.points, options.mean_track, images, length_random);
  Random random(options.seed, kTracks);
  Tracks tracks;
  std::vector<std::uint32_t> chosen;
  for (std::uint64_t i = 0; i < options.points; ++i) {
    const std::uint32_t length = lengths[i];
    const auto window =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(images, length + length / 2 + 1));
    const double share = (static_cast<double>(i) + random.uniform()) / options.points;
    const double start = share * images - window / 2.0;
    const double last = lakeside.closed() ? images - 1 : images - window;
    const double wrapped = lakeside.closed() && start < 0 ? start + images : start;
    const auto first = static_cast<std::uint32_t>(std::clamp(wrapped, 0.0, last));
    std::array<double, 3> point;
    for (int attempt = 0; attempt < 12; ++attempt) {
      point = lakeside.point_before(first, window, attempt, random);
      choose_images(first, window, length, images, random, chosen);
      if (std::all_of(chosen.begin(), chosen.end(),
                      [&](std::uint32_t image) { return lakeside.sees(image, point); }))
        break;
    }
    tracks.points.insert(tracks.points.end(), point.begin(), point.end());
    tracks.images.insert(tracks.images.end(), chosen.begin(), chosen.end());
    tracks.begin.push_back(tracks.images.size());
  }
  return tracks;
}

std::array<double, 3> point_of(const Tracks& tracks, std::uint64_t i) {
  return {tracks.points[3 * i], tracks.points[3 * i + 1], tracks.points[3 * i + 2]};
}

bool has_image(const Tracks& tracks, std::uint64_t i, std::uint32_t image) {
  return std::binary_search(tracks.images.begin() + tracks.begin[i],
                            tracks.images.begin() + tracks.begin[i + 1], image);
}

// (point, image) pairs that give images with few observations more of them, out of the points whose
// tracks are centred nearby.
std::vector<std::pair<std::uint64_t, std::uint32_t>> find_additions(
    const Tracks& tracks, const Lakeside& lakeside, std::vector<std::uint32_t>& counts) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> additions;
  const std::uint64_t points = tracks.begin.size() - 1;
  const std::uint64_t images = counts.size();
  for (std::uint32_t j = 0; j < images; ++j) {
    const auto near = static_cast<std::uint64_t>((j + 0.5) / static_cast<double>(images) * points);
    for (std::uint64_t k = 0; k < 400 && counts[j] < kFewestObservations; ++k) {
      const std::uint64_t step = (k + 1) / 2;
      if (k % 2 == 1 ? step > near : near + step >= points) continue;
      const std::uint64_t i = k % 2 == 1 ? near - step : near + step;
      if (has_image(tracks, i, j) || !lakeside.sees(j, point_of(tracks, i))) continue;
      additions.emplace_back(i, j);
      ++counts[j];
    }
  }
  std::sort(additions.begin(), additions.end());
  return additions;
}

// Gives images with few observations more, and takes as many from images and points with plenty.
void even_out(Tracks& tracks, const Lakeside& lakeside) {
  std::vector<std::uint32_t> counts(lakeside.stations().size(), 0);
  for (const std::uint32_t image : tracks.images) ++counts[image];
  const auto additions = find_additions(tracks, lakeside, counts);
  if (additions.empty()) return;
  std::uint64_t surplus = additions.size();
  Tracks out;
  auto next = additions.begin();
  for (std::uint64_t i = 0; i + 1 < tracks.begin.size(); ++i) {
    std::uint64_t left = tracks.begin[i + 1] - tracks.begin[i];
    for (std::uint64_t k = tracks.begin[i]; k < tracks.begin[i + 1]; ++k) {
      const std::uint32_t image = tracks.images[k];
      if (surplus > 0 && left > 2 && counts[image] > kFewestObservations) {
        --surplus, --left, --counts[image];
        continue;
      }
      out.images.push_back(image);
    }
    for (; next != additions.end() && next->first == i; ++next) out.images.push_back(next->second);
    std::sort(out.images.begin() + out.begin.back(), out.images.end());
    out.begin.push_back(out.images.size());
  }
  out.points = std::move(tracks.points);
  tracks = std::move(out);
}

Problem make_truth(const Tracks& tracks, const Lakeside& lakeside) {
  Problem truth;
  for (const Lakeside::Station& station : lakeside.stations()) {
    // As a reader of the file would convert it, so that the writer recognises it.
    truth.add_image({quaternion_from_angle_axis(station.angle_axis), station.translation},
                    Camera{CameraModel::bal,
                           {station.intrinsics[0], station.intrinsics[1], station.intrinsics[2]}});
    truth.bal_angle_axis.insert(truth.bal_angle_axis.end(), station.angle_axis.begin(),
                                station.angle_axis.end());
  }
  truth.points = tracks.points;
  truth.observation_image = tracks.images;
  truth.observation_point.reserve(tracks.images.size());
  truth.observation_xy.reserve(2 * tracks.images.size());
  for (std::uint64_t i = 0; i + 1 < tracks.begin.size(); ++i) {
    for (std::uint64_t k = tracks.begin[i]; k < tracks.begin[i + 1]; ++k) {
      const auto pixel = lakeside.project(tracks.images[k], point_of(tracks, i));
      truth.observation_point.push_back(static_cast<std::uint32_t>(i));
      truth.observation_xy.insert(truth.observation_xy.end(), pixel.begin(), pixel.end());
    }
  }
  return truth;
}

std::array<double, 3> normal3(Random& random, double deviation) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {deviation * x, deviation * y, deviation * z};
}

// R <- exp(phi) R, C <- C + d; t = -R C = exp(phi) (t - R d).
void disturb_images(Problem& start, const Lakeside& lakeside, const SceneOptions& options) {
  Random random(options.seed, kCameras);
  for (std::size_t j = 0; j < start.num_images(); ++j) {
    const Lakeside::Station& station = lakeside.stations()[j];
    const Quaternion<double> turn =
        portable_quaternion(normal3(random, options.rotation_noise_rad));
    const Vector3<double> step = normal3(random, options.center_noise);
    const Vector3<double> moved = multiply(station.rotation, step);
    Vector3<double> t = station.translation;
    for (int k = 0; k < 3; ++k) t[k] -= moved[k];
    start.poses[j].translation = multiply(portable_matrix(turn), t);
    const Vector3<double> angle_axis =
        portable_angle_axis(multiply(turn, portable_quaternion(station.angle_axis)));
    std::copy(angle_axis.begin(), angle_axis.end(), &start.bal_angle_axis[3 * j]);
    start.poses[j].rotation = quaternion_from_angle_axis(angle_axis);
    double& f = start.cameras[j].parameters[0];
    f = std::max(f * (1 + options.focal_noise * random.normal()), 0.05 * f);
  }
}

void disturb(Problem& start, const Lakeside& lakeside, const SceneOptions& options) {
  disturb_images(start, lakeside, options);
  Random point_random(options.seed, kPoints);
  for (double& x : start.points) x += options.point_noise * point_random.normal();
  Random pixel_random(options.seed, kPixels);
  for (double& x : start.observation_xy) x += options.pixel_noise_px * pixel_random.normal();
}

}  // namespace

Result<void> check_scene(const SceneOptions& o) {
  const auto refuse = [](const std::string& message) { return Error(ErrorCode::usage, message); };
  if (o.images < 2 || o.images >= UINT32_MAX)
    return refuse("a scene needs from 2 to 2^32 - 2 images, not " + std::to_string(o.images));
  if (o.points < 1 || o.points >= UINT32_MAX)
    return refuse("a scene needs from 1 to 2^32 - 2 points, not " + std::to_string(o.points));
  if (!(o.mean_track >= 2 && o.mean_track <= static_cast<double>(o.images)))
    return refuse("the mean track must be from 2 to the number of images, " +
                  std::to_string(o.images) + ", not " + std::to_string(o.mean_track));
  const std::pair<const char*, double> noises[] = {{"pixel noise", o.pixel_noise_px},
                                                   {"rotation noise", o.rotation_noise_rad},
                                                   {"center noise", o.center_noise},
                                                   {"point noise", o.point_noise},
                                                   {"focal noise", o.focal_noise}};
  for (const auto& [name, value] : noises)
    if (!(value >= 0) || !std::isfinite(value))
      return refuse(std::string("the ") + name + " must be a finite number from 0 up");
  return {};
}

Result<Scene> generate(const SceneOptions& options) {
  if (Result<void> result = check_scene(options); !result.ok()) return result.error();
  const Lakeside lakeside(static_cast<std::uint32_t>(options.images), options.seed);
  Tracks tracks = make_tracks(options, lakeside);
  even_out(tracks, lakeside);
  Scene scene;
  scene.truth = make_truth(tracks, lakeside);
  scene.start = scene.truth;
  disturb(scene.start, lakeside, options);
  return scene;
}

}  // namespace sheaf
