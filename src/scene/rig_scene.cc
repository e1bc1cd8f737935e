// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "geometry/known_kinds.h"
#include "platform/random.h"
#include "scene/rig_images.h"
#include "scene/rigs.h"
#include "scene/scene_checks.h"
#include "scene/scene_lenses.h"
#include "scene/scene_noise.h"
#include "scene/track_lengths.h"
#include "scene/view.h"

namespace sheaf {
namespace {

// Streams of the seed: another amount of one noise leaves everything else as it is.
enum Stream : std::uint64_t { kSpots = 41, kLengths, kPixels, kPoses, kPoints, kSensors };

constexpr std::uint32_t kLongest = 40;  ///< observations of a point
constexpr std::uint32_t kFewest = 12;   ///< observations of an image, where there are points enough
constexpr int kAttempts = 200;          ///< to place a point that two images see

struct Sight {
  std::uint32_t image;
  std::array<double, 2> pixel;
};
struct Track {
  RigStreet::Spot spot;
  double s = 0;  ///< way along the street
  std::vector<Sight> sights;
};

Error refuse(const std::string& message) { return Error(ErrorCode::usage, message); }

Result<void> check_rig_scene(const RigSceneOptions& o) {
  if (!is_known(o.model) || o.kind > RigKind::around)
    return refuse("the rig's kind or its camera model is none that there is");
  if (o.model == CameraModel::bal) return refuse("a rig needs a camera model other than BAL");
  const std::uint64_t sensors = sensors_of(o);
  if (sensors > 100) return refuse("a rig has at most 100 sensors");
  if (o.frames < 2 || o.frames > 10000000) return refuse("frames must be from 2 to 10000000");
  if (!(o.missing >= 0 && o.missing <= 1))
    return refuse("the part of frames that miss a sensor must be from 0 to 1");
  for (const double noise : {o.sensor_rotation_noise_rad, o.sensor_translation_noise})
    if (!(noise >= 0) || !std::isfinite(noise))
      return refuse("the noise of sensors must be a finite number from 0 up");
  SceneOptions counted = o.scene;
  counted.images = sensors * o.frames + o.single_images;
  if (Result<void> good = check_scene(counted); !good.ok()) return good;
  if (o.scene.mean_track > kLongest)
    return refuse("points of a drive have at most " + std::to_string(kLongest) + " observations");
  LensSceneOptions lens{.model = o.model, .field_of_view_deg = view_deg_of(o)};
  if (const Result<double> view = field_of_view_deg(lens); !view.ok()) return view.error();
  return {};
}

/// Of the images that see the spot, about those of the frames nearest to one of them.
std::vector<Sight> choose_sights(const RigImages& images, const RigStreet::Spot& spot, double s,
                                 std::uint32_t length, Random& random) {
  std::vector<Sight> seen;
  for (const std::uint32_t j : images.near(s)) {
    Sight sight{j, {}};
    if (images.sees(j, spot, sight.pixel)) seen.push_back(sight);
  }
  if (seen.size() <= length) return seen;
  const std::uint32_t middle = seen[random.below(seen.size())].image;
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < seen.size(); ++k)
    order.push_back({images.frames_between(seen[k].image, middle) + random.uniform(0, 2.5), k});
  std::sort(order.begin(), order.end());
  std::vector<Sight> chosen;
  for (std::uint32_t k = 0; k < length; ++k) chosen.push_back(seen[order[k].second]);
  return chosen;
}

/// Whether some ray makes an angle of a degree with the first: a point between rays that noise
/// makes parallel would wander off.
bool has_parallax(const RigImages& images, const Track& track) {
  if (track.sights.size() < 2) return false;
  const Vector3<double> a = images.ray(track.sights[0].image, track.spot.X);
  return std::any_of(track.sights.begin() + 1, track.sights.end(), [&](const Sight& sight) {
    const Vector3<double> across = cross(a, images.ray(sight.image, track.spot.X));
    constexpr double kSine = 0.0174;
    return across[0] * across[0] + across[1] * across[1] + across[2] * across[2] > kSine * kSine;
  });
}

/// Points are looked for along the street, evenly and in order.
Result<std::vector<Track>> make_tracks(const SceneOptions& o, const RigImages& images) {
  Random length_random(o.seed, kLengths), random(o.seed, kSpots);
  const auto longest =
      static_cast<std::uint32_t>(std::min<std::uint64_t>(kLongest, images.problem().num_images()));
  const std::vector<std::uint32_t> lengths =
      draw_track_lengths(o.points, o.mean_track, longest, length_random);
  std::vector<Track> tracks(o.points);
  const RigImages::Reach reach = images.reach();
  std::uint64_t owed = 0;  // observations that tracks so far could not have
  for (std::uint64_t i = 0; i < o.points; ++i) {
    Track& track = tracks[i];
    const std::uint64_t wish = lengths[i] + owed;
    const auto length = static_cast<std::uint32_t>(std::min<std::uint64_t>(wish, longest));
    const double share =
        (static_cast<double>(i) + random.uniform()) / static_cast<double>(o.points);
    bool found = false;
    for (int attempt = 0; attempt < kAttempts && !found; ++attempt) {
      track.s = reach.from + share * (reach.to - reach.from) + attempt * random.uniform(-0.1, 0.1);
      track.spot = images.street().spot(track.s, random);
      track.sights = choose_sights(images, track.spot, track.s, length, random);
      found = has_parallax(images, track);
    }
    if (!found)
      return refuse("no place for point " + std::to_string(i) +
                    " was found that two images see under an angle");
    owed = wish > track.sights.size() ? wish - track.sights.size() : 0;
  }
  return tracks;
}

/// Images with few observations see more of the points around.
void even_out(const RigImages& images, std::vector<Track>& tracks) {
  std::vector<std::uint32_t> counts(images.problem().num_images(), 0);
  for (const Track& track : tracks)
    for (const Sight& sight : track.sights) ++counts[sight.image];
  if (*std::min_element(counts.begin(), counts.end()) >= kFewest) return;
  for (Track& track : tracks)
    for (const std::uint32_t j : images.near(track.s)) {
      if (counts[j] >= kFewest) continue;
      Sight sight{j, {}};
      const bool has = std::any_of(track.sights.begin(), track.sights.end(),
                                   [&](const Sight& other) { return other.image == j; });
      if (has || !images.sees(j, track.spot, sight.pixel)) continue;
      track.sights.push_back(sight);
      ++counts[j];
    }
}

Problem make_truth(const RigImages& images, std::vector<Track>& tracks) {
  Problem truth = images.problem();
  for (std::uint32_t i = 0; i < tracks.size(); ++i) {
    std::vector<Sight>& sights = tracks[i].sights;
    std::sort(sights.begin(), sights.end(),
              [](const Sight& a, const Sight& b) { return a.image < b.image; });
    const Vector3<double>& X = tracks[i].spot.X;
    truth.add_point(X[0], X[1], X[2]);
    for (const Sight& sight : sights)
      truth.add_observation(sight.image, i, sight.pixel[0], sight.pixel[1]);
  }
  return truth;
}

void disturb_rigs(const RigSceneOptions& o, Problem& start) {
  Rigs& rigs = start.rigs;
  Random poses(o.scene.seed, kPoses), sensors(o.scene.seed, kSensors);
  for (Pose& frame : rigs.rig_from_world)
    disturb_pose(poses, o.scene.rotation_noise_rad, o.scene.center_noise, frame);
  for (std::size_t j = 0; j < start.num_images(); ++j)
    if (!in_rig(rigs, j))
      disturb_pose(poses, o.scene.rotation_noise_rad, o.scene.center_noise, start.poses[j]);
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s) {
    if (rigs.is_reference[s] != 0) continue;
    Pose pose = rigs.sensor_from_rig[s];
    disturb_pose(sensors, o.sensor_rotation_noise_rad, 0, pose);
    const Vector3<double> moved = normal3(sensors, o.sensor_translation_noise);
    for (std::size_t k = 0; k < 3; ++k) pose.translation[k] += moved[k];
    if (o.sensor_rotation_noise_rad > 0 || o.sensor_translation_noise > 0)
      rigs.sensor_from_rig[s] = pose;
  }
  place_images(start);
}

}  // namespace

Result<Scene> generate(const RigSceneOptions& options) {
  if (Result<void> good = check_rig_scene(options); !good.ok()) return good.error();
  const SceneOptions& o = options.scene;
  const RigImages images(options);
  Result<std::vector<Track>> tracks = make_tracks(o, images);
  if (!tracks.ok()) return tracks.error();
  even_out(images, tracks.value());
  Scene out;
  out.truth = make_truth(images, tracks.value());
  out.start = out.truth;
  disturb_rigs(options, out.start);
  disturb_lenses(o, out.start);
  Random point_random(o.seed, kPoints), pixel_random(o.seed, kPixels);
  for (double& x : out.start.points) x += o.point_noise * point_random.normal();
  for (double& x : out.start.observation_xy) x += o.pixel_noise_px * pixel_random.normal();
  return out;
}

}  // namespace sheaf
