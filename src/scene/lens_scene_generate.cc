// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "geometry/known_kinds.h"
#include "platform/random.h"
#include "scene/camera_frame.h"
#include "scene/lens_scene.h"
#include "scene/scene_checks.h"
#include "scene/scene_lenses.h"
#include "scene/scene_noise.h"
#include "scene/track_lengths.h"

namespace sheaf {
namespace {

// Streams of the seed: another amount of one noise leaves everything else as it is.
enum Stream : std::uint64_t { kPlaces = 12, kLengths, kPixels, kPoses, kPoints };

constexpr std::uint32_t kFewest = 12;  ///< observations of an image, where there are points enough
constexpr int kAttempts = 200;         ///< to place a point that two images see

struct View {
  std::uint32_t image;
  std::array<double, 2> pixel;
};
using Track = std::vector<View>;

/// Of those of `count` images from `first` on (around the ring) that see the point, `length` or
/// all, each choice equally likely; ascending.
Track choose_views(const LensScene& scene, const std::array<double, 3>& point, std::uint32_t first,
                   std::uint32_t count, std::uint32_t length, Random& random) {
  const auto images = static_cast<std::uint32_t>(scene.poses().size());
  Track track;
  for (std::uint32_t k = 0; k < count; ++k) {
    View view{(first + k) % images, {}};
    if (scene.sees(view.image, point, view.pixel)) track.push_back(view);
  }
  for (std::uint32_t k = 0; k < length && track.size() > length; ++k)
    std::swap(track[k], track[k + random.below(track.size() - k)]);
  if (track.size() > length) track.resize(length);
  std::sort(track.begin(), track.end(),
            [](const View& a, const View& b) { return a.image < b.image; });
  return track;
}

/// Whether some ray makes an angle of a degree with the first: a point between rays that noise
/// makes parallel would wander off.
bool has_parallax(const LensScene& scene, const std::array<double, 3>& point, const Track& track) {
  if (track.size() < 2) return false;
  const std::array<double, 3> a = scene.ray(track[0].image, point);
  return std::any_of(track.begin() + 1, track.end(), [&](const View& view) {
    const std::array<double, 3> b = scene.ray(view.image, point);
    const Vector3<double> across = cross(a, b);
    constexpr double kSine = 0.0174;
    return across[0] * across[0] + across[1] * across[1] + across[2] * across[2] > kSine * kSine;
  });
}

/// The places where points are looked for walk once around the ring, so that images share them
/// evenly.
Result<std::vector<Track>> make_tracks(const SceneOptions& o, const LensScene& scene,
                                       std::vector<double>& points) {
  const auto images = static_cast<std::uint32_t>(o.images);
  Random length_random(o.seed, kLengths), random(o.seed, kPlaces);
  const std::vector<std::uint32_t> lengths =
      draw_track_lengths(o.points, o.mean_track, images, length_random);
  std::vector<Track> tracks(o.points);
  for (std::uint64_t i = 0; i < o.points; ++i) {
    const std::uint32_t count =
        std::min(images, std::max(lengths[i] + lengths[i] / 2 + 1, images / 12));
    const double share =
        (static_cast<double>(i) + random.uniform()) / static_cast<double>(o.points);
    const auto first = static_cast<std::uint32_t>(share * images) % images;
    std::array<double, 3> point;
    bool found = false;
    for (int attempt = 0; attempt < kAttempts && !found; ++attempt) {
      point = scene.point(random);
      tracks[i] = choose_views(scene, point, first, count, lengths[i], random);
      found = has_parallax(scene, point, tracks[i]);
    }
    if (!found)
      return Error(ErrorCode::usage, "no place for point " + std::to_string(i) +
                                         " was found that two images see under an angle");
    points.insert(points.end(), point.begin(), point.end());
  }
  return tracks;
}

/// Images with few observations see more of the points.
void even_out(const LensScene& scene, const std::vector<double>& points,
              std::vector<Track>& tracks) {
  std::vector<std::uint32_t> counts(scene.poses().size(), 0);
  for (const Track& track : tracks)
    for (const View& view : track) ++counts[view.image];
  for (std::uint32_t j = 0; j < counts.size(); ++j)
    for (std::size_t i = 0; i < tracks.size() && counts[j] < kFewest; ++i) {
      const auto place = std::lower_bound(
          tracks[i].begin(), tracks[i].end(), j,
          [](const View& view, std::uint32_t image) { return view.image < image; });
      if (place != tracks[i].end() && place->image == j) continue;
      View view{j, {}};
      if (!scene.sees(j, {points[3 * i], points[3 * i + 1], points[3 * i + 2]}, view.pixel))
        continue;
      tracks[i].insert(place, view);
      ++counts[j];
    }
}

std::shared_ptr<const SceneMetadata> names_of(std::size_t images) {
  auto names = std::make_shared<SceneMetadata>();
  for (std::size_t j = 0; j < images; ++j) {
    std::string number = std::to_string(j + 1);
    number.insert(0, 6 - std::min<std::size_t>(6, number.size()), '0');
    names->image_names.push_back("image-" + number + ".png");
  }
  return names;
}

Problem make_truth(const LensScene& scene, const std::vector<Track>& tracks,
                   std::vector<double> points) {
  Problem truth;
  truth.cameras = scene.lenses();
  for (std::uint32_t j = 0; j < scene.poses().size(); ++j)
    truth.add_image(scene.poses()[j], scene.lens_of(j));
  truth.points = std::move(points);
  for (std::uint32_t i = 0; i < tracks.size(); ++i)
    for (const View& view : tracks[i])
      truth.add_observation(view.image, i, view.pixel[0], view.pixel[1]);
  truth.metadata = names_of(truth.num_images());
  return truth;
}

void disturb_poses(const SceneOptions& o, Problem& start) {
  Random random(o.seed, kPoses);
  for (Pose& pose : start.poses) disturb_pose(random, o.rotation_noise_rad, o.center_noise, pose);
}

}  // namespace

Result<Scene> generate(const LensSceneOptions& options) {
  const SceneOptions& o = options.scene;
  if (!is_known(options.model))
    return Error(ErrorCode::usage, "the camera model is none that there is");
  if (Result<void> result = check_scene(o); !result.ok()) return result.error();
  if (const Result<double> view = field_of_view_deg(options); !view.ok()) return view.error();
  const LensScene scene(options);
  std::vector<double> points;
  Result<std::vector<Track>> tracks = make_tracks(o, scene, points);
  if (!tracks.ok()) return tracks.error();
  even_out(scene, points, tracks.value());
  Scene out;
  out.truth = make_truth(scene, tracks.value(), std::move(points));
  out.start = out.truth;
  disturb_poses(o, out.start);
  disturb_lenses(o, out.start);
  Random point_random(o.seed, kPoints), pixel_random(o.seed, kPixels);
  for (double& x : out.start.points) x += o.point_noise * point_random.normal();
  for (double& x : out.start.observation_xy) x += o.pixel_noise_px * pixel_random.normal();
  if (options.model != CameraModel::bal) return out;
  for (Problem* problem : {&out.start, &out.truth}) to_bal_cameras(*problem).value();
  return out;
}

}  // namespace sheaf
