// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_configuration.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "geometry/rotation.h"
#include "platform/unicode.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kNone = Rigs::kNone;

Pose inverse(const Pose& pose) { return frame_from_image(pose, Pose()); }
Pose composed(const Pose& second, const Pose& first) { return pose_in_rig(second, first); }

std::string quoted_name(const std::string& name) { return "'" + name + "'"; }

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Laying {
 public:
  Laying(const Problem& problem, const std::vector<RigConfiguration>& configurations)
      : problem_(problem), configurations_(configurations) {}

  Result<RigLayout> run(Problem& out) {
    for (const auto& step : {&Laying::check, &Laying::add_rigs, &Laying::sort_images,
                             &Laying::share_no_lens, &Laying::place_sensors})
      if (Result<void> done = (this->*step)(); !done.ok()) return done.error();
    place_frames();
    measure();
    out = std::move(problem_);
    return std::move(layout_);
  }

 private:
  static Error refuse(const std::string& what) { return Error(ErrorCode::usage, what); }

  Result<void> check() {
    if (!problem_.rigs.empty())
      return refuse("the problem has rigs already; a rig configuration is for one without");
    if (problem_.metadata == nullptr || problem_.metadata->image_names.empty())
      return refuse("the problem has no names of images, by which a rig configuration tells them");
    if (configurations_.empty()) return refuse("the rig configuration has no rig");
    return {};
  }

  /// A sensor for each camera of the configurations.
  Result<void> add_rigs() {
    Rigs& rigs = problem_.rigs;
    for (const RigConfiguration& configuration : configurations_) {
      const auto references =
          std::count_if(configuration.cameras.begin(), configuration.cameras.end(),
                        [](const RigCamera& camera) { return camera.reference; });
      if (references != 1)
        return refuse("rig " + std::to_string(rigs.count + 1) + " of the rig configuration has " +
                      std::to_string(references) + " reference sensors, and needs one");
      for (const RigCamera& camera : configuration.cameras) {
        if (camera.reference && camera.cam_from_rig)
          return refuse("the camera with the prefix " + quoted_name(camera.image_prefix) +
                        " is its rig's reference, and cannot have a cam_from_rig");
        cameras_.push_back(&camera);
        rigs.sensor_from_rig.push_back(camera.cam_from_rig.value_or(Pose()));
        rigs.sensor_rig.push_back(rigs.count);
        rigs.is_reference.push_back(camera.reference);
        SensorSpread& spread = layout_.sensors.emplace_back();
        spread.sensor = static_cast<std::uint32_t>(cameras_.size() - 1);
        spread.image_prefix = camera.image_prefix;
        spread.reference = camera.reference;
        spread.stated = camera.cam_from_rig.has_value();
      }
      ++rigs.count;
    }
    return {};
  }

  /// The sensor and the frame of each image, by its name. Frames of a rig stand in the order of
  /// what is left of their images' names.
  Result<void> sort_images() {
    Rigs& rigs = problem_.rigs;
    std::vector<std::string> names, prefixes;
    for (const std::string& name : problem_.metadata->image_names)
      names.push_back(comparable_name(name));
    for (const RigCamera* camera : cameras_)
      prefixes.push_back(comparable_name(camera->image_prefix));
    rigs.image_frame.assign(names.size(), kNone);
    rigs.image_sensor = rigs.image_frame;
    std::map<std::pair<std::uint32_t, std::string>, std::vector<std::uint32_t>> frames;
    for (std::uint32_t j = 0; j < names.size(); ++j) {
      for (std::uint32_t s = 0; s < cameras_.size(); ++s) {
        const std::string& prefix = prefixes[s];
        if (!names[j].starts_with(prefix)) continue;
        std::uint32_t& sensor = rigs.image_sensor[j];
        if (sensor != kNone)
          return refuse("the image " + quoted_name(names[j]) +
                        " begins with two prefixes of the rig configuration, " +
                        quoted_name(cameras_[sensor]->image_prefix) + " and " +
                        quoted_name(prefix));
        sensor = s;
        frames[{rigs.sensor_rig[s], names[j].substr(prefix.size())}].push_back(j);
      }
    }
    for (const auto& [frame, images] : frames) {
      for (const std::uint32_t j : images) {
        rigs.image_frame[j] = static_cast<std::uint32_t>(rigs.num_frames());
        ++layout_.sensors[rigs.image_sensor[j]].images;
      }
      layout_.images += static_cast<std::uint32_t>(images.size());
      rigs.frame_rig.push_back(frame.first);
      rigs.rig_from_world.emplace_back();
      images_.push_back(images);
    }
    layout_.frames = static_cast<std::uint32_t>(frames.size());
    layout_.images_of_no_rig = static_cast<std::uint32_t>(names.size()) - layout_.images;
    for (const SensorSpread& sensor : layout_.sensors)
      if (sensor.images == 0)
        return refuse("no image's name begins with " + quoted_name(sensor.image_prefix) +
                      ", a prefix of the rig configuration; the first image is " +
                      quoted_name(names.empty() ? "" : names[0]));
    return {};
  }

  /// COLMAP has one camera for each sensor, which is of one rig.
  Result<void> share_no_lens() {
    const Rigs& rigs = problem_.rigs;
    auto metadata = std::make_shared<SceneMetadata>(*problem_.metadata);
    std::vector<std::uint32_t> lens(cameras_.size(), kNone);
    for (std::uint32_t j = 0; j < problem_.num_images(); ++j) {
      const std::uint32_t s = rigs.image_sensor[j];
      if (s == kNone) continue;
      if (lens[s] != kNone && lens[s] != problem_.image_camera[j])
        return refuse("images with the prefix " + quoted_name(cameras_[s]->image_prefix) +
                      " have several cameras; a sensor of a rig has one");
      lens[s] = problem_.image_camera[j];
    }
    for (std::uint32_t s = 0; s < cameras_.size(); ++s) {
      if (std::find(lens.begin(), lens.begin() + s, lens[s]) == lens.begin() + s) continue;
      const auto copy = static_cast<std::uint32_t>(problem_.cameras.size());
      problem_.cameras.push_back(problem_.cameras[lens[s]]);
      auto& ids = metadata->camera_ids;
      if (!ids.empty()) ids.push_back(*std::max_element(ids.begin(), ids.end()) + 1);
      for (std::uint32_t j = 0; j < problem_.num_images(); ++j)
        if (rigs.image_sensor[j] == s) problem_.image_camera[j] = copy;
      lens[s] = copy;
      ++layout_.copied_cameras;
    }
    metadata->rig_ids.clear();
    metadata->frame_ids.clear();
    metadata->sensor_ids.clear();
    metadata->stale_poses.clear();
    problem_.metadata = std::move(metadata);
    return {};
  }

  /// rig_from_cam of a sensor as the frames have it that hold one of its images and one of a
  /// sensor that is placed: the reference where it is there.
  std::vector<Pose> seen_places(std::uint32_t sensor, const std::vector<bool>& placed) const {
    const Rigs& rigs = problem_.rigs;
    std::vector<Pose> places;
    for (const std::vector<std::uint32_t>& images : images_) {
      std::uint32_t own = kNone, other = kNone;
      for (const std::uint32_t j : images) {
        const std::uint32_t s = rigs.image_sensor[j];
        if (s == sensor) own = j;
        if (s != sensor && placed[s] && (other == kNone || rigs.is_reference[s] != 0)) other = j;
      }
      if (own == kNone || other == kNone) continue;
      const Pose frame =
          frame_from_image(rigs.sensor_from_rig[rigs.image_sensor[other]], problem_.poses[other]);
      places.push_back(composed(frame, inverse(problem_.poses[own])));
    }
    return places;
  }

  /// Those that the reference tells first, then those that these tell, and so on.
  Result<void> place_sensors() {
    Rigs& rigs = problem_.rigs;
    std::vector<bool> placed;
    for (const RigCamera* camera : cameras_)
      placed.push_back(camera->reference || camera->cam_from_rig);
    for (bool moved = true; moved;) {
      moved = false;
      const std::vector<bool> known = placed;
      for (std::uint32_t s = 0; s < cameras_.size(); ++s) {
        if (placed[s]) continue;
        const std::vector<Pose> places = seen_places(s, known);
        if (places.empty()) continue;
        rigs.sensor_from_rig[s] = inverse(robust_mean(places));
        placed[s] = moved = true;
      }
    }
    for (std::uint32_t s = 0; s < cameras_.size(); ++s)
      if (!placed[s])
        return refuse("nothing says where the camera with the prefix " +
                      quoted_name(cameras_[s]->image_prefix) +
                      " sits in its rig: it has no image in a frame with the reference's; state "
                      "cam_from_rig_rotation and cam_from_rig_translation");
    return {};
  }

  void place_frames() {
    Rigs& rigs = problem_.rigs;
    before_ = problem_.poses;
    for (std::size_t f = 0; f < images_.size(); ++f) {
      std::vector<Pose> told;
      for (const std::uint32_t j : images_[f]) {
        const std::uint32_t s = rigs.image_sensor[j];
        const Pose frame = frame_from_image(rigs.sensor_from_rig[s], problem_.poses[j]);
        if (rigs.is_reference[s] != 0) {
          told = {frame};
          break;
        }
        told.push_back(frame);
      }
      rigs.rig_from_world[f] = robust_mean(told);
    }
    place_images(problem_);
  }

  /// What each sensor's images had against what its rig says, from the reference where it is there.
  void measure() {
    const Rigs& rigs = problem_.rigs;
    const std::vector<bool> all(cameras_.size(), true);
    std::swap(before_, problem_.poses);
    for (SensorSpread& spread : layout_.sensors) {
      if (spread.reference) continue;
      const Pose place = inverse(rigs.sensor_from_rig[spread.sensor]);
      std::vector<double> turns, shifts;
      for (const Pose& seen : seen_places(spread.sensor, all)) {
        double dot = 0, shift2 = 0;
        for (std::size_t k = 0; k < 4; ++k) dot += seen.rotation[k] * place.rotation[k];
        double off2 = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          const double off = seen.rotation[k] - (dot < 0 ? -1 : 1) * place.rotation[k];
          off2 += off * off;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double shift = seen.translation[k] - place.translation[k];
          shift2 += shift * shift;
        }
        turns.push_back(4 * std::asin(std::min(1.0, std::sqrt(off2) / 2)));
        shifts.push_back(std::sqrt(shift2));
      }
      spread.frames = static_cast<std::uint32_t>(turns.size());
      spread.median_rotation_rad = median_of(turns);
      spread.median_translation = median_of(shifts);
      for (const double turn : turns)
        spread.max_rotation_rad = std::max(spread.max_rotation_rad, turn);
      for (const double shift : shifts)
        spread.max_translation = std::max(spread.max_translation, shift);
    }
    std::swap(before_, problem_.poses);
  }

  Problem problem_;
  const std::vector<RigConfiguration>& configurations_;
  RigLayout layout_;
  std::vector<const RigCamera*> cameras_;           ///< of each sensor
  std::vector<std::vector<std::uint32_t>> images_;  ///< of each frame
  std::vector<Pose> before_;
};

}  // namespace

Result<RigLayout> lay_rigs(Problem& problem, const std::vector<RigConfiguration>& rigs) {
  return Laying(problem, rigs).run(problem);
}

}  // namespace sheaf
