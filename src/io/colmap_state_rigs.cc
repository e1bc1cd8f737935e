// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "io/colmap_rigs.h"
#include "scene/rigs.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kNone = Rigs::kNone;

/// What the problem's rigs are called.
struct RigNames {
  std::vector<std::uint32_t> rigs, frames, sensors;
};

/// The numbers of a pose: as they were stated, where it is still what these say, to COLMAP too: it
/// does not normalise. `as_read`: nothing at all has changed.
void restate_pose(const Pose& pose, std::array<double, 7>& stated, bool as_read) {
  if (same_bits(pose_from_stated(stated), pose) && (as_read || states_a_rotation(stated))) return;
  std::copy_n(pose.rotation.begin(), 4, stated.begin());
  std::copy_n(pose.translation.begin(), 3, stated.begin() + 4);
}

bool takes_images(const FrameRecord& frame) {
  return std::any_of(frame.data.begin(), frame.data.end(),
                     [](const FrameDatum& d) { return d.type == SensorType::camera; });
}

/// Rigs of a model all of whose frames are trivial: of such a model the problem has none.
Rigs trivial_rigs(const ColmapForm& form, const ColmapRigs& source, RigNames& names) {
  Rigs rigs;
  std::unordered_map<std::uint64_t, std::uint32_t> image_of_id;
  for (std::uint32_t j = 0; j < form.image_ids.size(); ++j) image_of_id[form.image_ids[j]] = j;
  rigs.image_frame.assign(form.image_ids.size(), kNone);
  rigs.image_sensor = rigs.image_frame;
  std::unordered_map<std::uint32_t, std::uint32_t> number;
  for (const RigRecord& rig : source.rigs) {
    if (rig.sensors.empty() || rig.sensors[0].type != SensorType::camera) continue;
    number[rig.id] = rigs.count++;
    names.rigs.push_back(rig.id);
    names.sensors.push_back(rig.sensors[0].id);
    rigs.sensor_from_rig.push_back({});
    rigs.sensor_rig.push_back(number[rig.id]);
    rigs.is_reference.push_back(1);
  }
  for (const FrameRecord& frame : source.frames)
    for (const FrameDatum& datum : frame.data) {
      const auto image = image_of_id.find(datum.id);
      if (datum.type != SensorType::camera || image == image_of_id.end()) continue;
      rigs.image_frame[image->second] = static_cast<std::uint32_t>(rigs.num_frames());
      rigs.image_sensor[image->second] = number.at(frame.rig);
      rigs.rig_from_world.push_back(form.problem->poses[image->second]);
      rigs.frame_rig.push_back(number.at(frame.rig));
      names.frames.push_back(frame.id);
    }
  return rigs;
}

/// Puts the records of a problem with rigs together.
class Stating {
 public:
  Stating(const ColmapForm& form, Rigs rigs, RigNames names, const ColmapRigs& source)
      : form_(form), rigs_(std::move(rigs)), names_(std::move(names)), source_(source) {
    sensors_of_rig_.resize(rigs_.count);
    for (std::uint32_t s = 0; s < rigs_.num_sensors(); ++s)
      sensors_of_rig_[rigs_.sensor_rig[s]].push_back(s);
  }

  Result<ColmapRigs> run() {
    if (Result<void> done = find_cameras(); !done.ok()) return done.error();
    keep_rigs();
    if (Result<void> done = add_rigs(); !done.ok()) return done.error();
    sort_images();
    keep_frames();
    for (std::uint32_t f = 0; f < rigs_.num_frames(); ++f)
      if (!stated_[f]) add_frame(f);
    add_images_of_no_rig();
    return std::move(out_);
  }

 private:
  Error refuse(const std::string& what) const { return Error(ErrorCode::usage, what); }

  void restate(const Pose& pose, std::array<double, 7>& stated) const {
    restate_pose(pose, stated, form_.as_read);
  }

  std::uint32_t camera_id(std::uint32_t image) const {
    return form_.camera_ids[form_.problem->image_camera[image]];
  }

  /// The camera of each sensor: that of its images, or, where it has none, what it was called.
  Result<void> find_cameras() {
    std::vector<std::uint32_t> lens(rigs_.num_sensors(), kNone);
    for (std::uint32_t j = 0; j < form_.image_ids.size(); ++j) {
      const std::uint32_t s = rigs_.image_sensor[j], c = form_.problem->image_camera[j];
      if (s == kNone) continue;
      if (lens[s] != kNone && lens[s] != c)
        return refuse("sensor " + std::to_string(s) + " has images through camera " +
                      std::to_string(lens[s]) + " and camera " + std::to_string(c) +
                      "; a COLMAP model has one camera for each sensor of a rig");
      lens[s] = c;
    }
    const std::unordered_set<std::uint32_t> cameras(form_.camera_ids.begin(),
                                                    form_.camera_ids.end());
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> sensor_of_camera;
    for (std::uint32_t s = 0; s < lens.size(); ++s) {
      const bool named = !names_.sensors.empty() && cameras.contains(names_.sensors[s]);
      cameras_.push_back(lens[s] != kNone ? std::optional(form_.camera_ids[lens[s]])
                         : named          ? std::optional(names_.sensors[s])
                                          : std::nullopt);
      if (!cameras_[s]) continue;
      const auto [other, first] =
          sensor_of_camera.try_emplace({rigs_.sensor_rig[s], *cameras_[s]}, s);
      if (!first)
        return refuse("sensors " + std::to_string(other->second) + " and " + std::to_string(s) +
                      " of rig " + std::to_string(rigs_.sensor_rig[s]) +
                      " have one camera, with the id " + std::to_string(*cameras_[s]) +
                      "; a COLMAP model has one camera for each sensor of a rig: give each "
                      "sensor a camera of its own");
    }
    return {};
  }

  /// Of the source: those that are still there, and those that never took an image.
  void keep_rigs() {
    std::unordered_set<std::uint32_t> with_images;
    for (const FrameRecord& frame : source_.frames)
      if (takes_images(frame)) with_images.insert(frame.rig);
    std::unordered_map<std::uint32_t, std::uint32_t> number;
    for (std::uint32_t r = 0; r < names_.rigs.size(); ++r) number[names_.rigs[r]] = r;
    for (const RigRecord& record : source_.rigs) {
      const auto at = number.find(record.id);
      if (at == number.end() && with_images.contains(record.id)) continue;
      kept_rigs_.insert(record.id);
      out_.rigs.push_back(record);
      if (at == number.end()) continue;
      for (const std::uint32_t s : sensors_of_rig_[at->second]) put_sensor(s, out_.rigs.back());
    }
  }

  /// Into the record's sensor of that name, or behind them.
  void put_sensor(std::uint32_t s, RigRecord& rig) {
    if (!cameras_[s]) return;
    const auto is_it = [&](const RigSensor& sensor) {
      return sensor.type == SensorType::camera && !names_.sensors.empty() &&
             sensor.id == names_.sensors[s];
    };
    auto at = std::find_if(rig.sensors.begin(), rig.sensors.end(), is_it);
    if (at == rig.sensors.end()) at = rig.sensors.insert(at, RigSensor());
    at->id = *cameras_[s];
    if (rigs_.is_reference[s] == 0)
      restate(rigs_.sensor_from_rig[s], at->pose ? *at->pose : at->pose.emplace());
  }

  /// Those of which the source knows nothing: the reference first.
  Result<void> add_rigs() {
    for (std::uint32_t r = 0; r < rigs_.count; ++r) {
      if (kept_rigs_.contains(names_.rigs[r])) continue;
      RigRecord& record = out_.rigs.emplace_back();
      record.id = names_.rigs[r];
      for (const std::uint8_t reference : {1, 0})
        for (const std::uint32_t s : sensors_of_rig_[r]) {
          if (rigs_.is_reference[s] != reference || !cameras_[s]) continue;
          RigSensor& sensor = record.sensors.emplace_back();
          sensor.id = *cameras_[s];
          if (reference == 0) restate(rigs_.sensor_from_rig[s], sensor.pose.emplace());
        }
      if (record.sensors.empty() || record.sensors[0].pose)
        return refuse("rig " + std::to_string(r) +
                      " has no reference sensor that took an image; a COLMAP model has one for "
                      "each rig");
    }
    return {};
  }

  void sort_images() {
    images_of_frame_.resize(rigs_.num_frames());
    for (std::uint32_t j = 0; j < form_.image_ids.size(); ++j)
      if (rigs_.image_frame[j] != kNone) images_of_frame_[rigs_.image_frame[j]].push_back(j);
    stated_.assign(rigs_.num_frames(), false);
  }

  FrameDatum datum_of(std::uint32_t image) const {
    return {SensorType::camera, camera_id(image), form_.image_ids[image]};
  }

  /// Of the source, likewise; what they say of images that are gone or elsewhere now is left out.
  void keep_frames() {
    std::unordered_map<std::uint32_t, std::uint32_t> number;
    for (std::uint32_t f = 0; f < names_.frames.size(); ++f) number[names_.frames[f]] = f;
    for (const FrameRecord& record : source_.frames) {
      const auto at = number.find(record.id);
      const bool known = at != number.end();
      if (!known && (takes_images(record) || !kept_rigs_.contains(record.rig))) continue;
      FrameRecord& frame = out_.frames.emplace_back(record);
      if (!known) continue;
      const std::uint32_t f = at->second;
      stated_[f] = true;
      frame.rig = names_.rigs[rigs_.frame_rig[f]];
      restate(rigs_.rig_from_world[f], frame.pose);
      std::vector<FrameDatum> here;
      for (const std::uint32_t j : images_of_frame_[f]) here.push_back(datum_of(j));
      const auto find_in = [](std::vector<FrameDatum>& list, const FrameDatum& datum) {
        return std::find_if(list.begin(), list.end(), [&](const FrameDatum& other) {
          return other.type == datum.type && other.id == datum.id;
        });
      };
      std::erase_if(frame.data, [&](const FrameDatum& datum) {
        return datum.type == SensorType::camera && find_in(here, datum) == here.end();
      });
      for (const FrameDatum& datum : here) {
        const auto place = find_in(frame.data, datum);
        if (place == frame.data.end()) {
          frame.data.push_back(datum);
        } else {
          *place = datum;
        }
      }
    }
  }

  void add_frame(std::uint32_t f) {
    FrameRecord& frame = out_.frames.emplace_back();
    frame.id = names_.frames[f];
    frame.rig = names_.rigs[rigs_.frame_rig[f]];
    restate(rigs_.rig_from_world[f], frame.pose);
    for (const std::uint32_t j : images_of_frame_[f]) frame.data.push_back(datum_of(j));
  }

  /// Each is a frame of its own: of the rig that has its camera, or of a new one that is no more
  /// than this camera.
  void add_images_of_no_rig() {
    std::unordered_map<std::uint32_t, std::pair<std::uint32_t, Pose>> home;  // of a camera
    for (const RigRecord& rig : out_.rigs)
      for (std::size_t k = 0; k < rig.sensors.size(); ++k) {
        const RigSensor& sensor = rig.sensors[k];
        if (sensor.type == SensorType::camera && (k == 0 || sensor.pose))
          home.try_emplace(sensor.id, rig.id, k == 0 ? Pose() : pose_from_stated(*sensor.pose));
      }
    std::uint32_t next_rig = 1, next_frame = 1;
    for (const RigRecord& rig : out_.rigs) next_rig = std::max(next_rig, rig.id + 1);
    for (const FrameRecord& frame : out_.frames) next_frame = std::max(next_frame, frame.id + 1);
    for (std::uint32_t j = 0; j < form_.image_ids.size(); ++j) {
      if (rigs_.image_frame[j] != kNone) continue;
      const auto [at, fresh] = home.try_emplace(camera_id(j), next_rig, Pose());
      if (fresh) {
        RigRecord& rig = out_.rigs.emplace_back();
        rig.id = next_rig++;
        rig.sensors.push_back({SensorType::camera, camera_id(j)});
      }
      FrameRecord& frame = out_.frames.emplace_back();
      frame.id = next_frame++;
      frame.rig = at->second.first;
      restate(frame_from_image(at->second.second, form_.problem->poses[j]), frame.pose);
      frame.data.push_back(datum_of(j));
    }
  }

  const ColmapForm& form_;
  const Rigs rigs_;
  const RigNames names_;
  const ColmapRigs& source_;
  ColmapRigs out_;
  std::vector<std::vector<std::uint32_t>> sensors_of_rig_;
  std::vector<std::optional<std::uint32_t>> cameras_;  ///< id of each sensor's camera
  std::unordered_set<std::uint32_t> kept_rigs_;        ///< ids of the source's rigs that stay
  std::vector<std::vector<std::uint32_t>> images_of_frame_;
  std::vector<bool> stated_;  ///< frames that the source knows
};

std::vector<std::uint32_t> numbers_from_1(std::size_t count) {
  std::vector<std::uint32_t> out(count);
  std::iota(out.begin(), out.end(), 1u);
  return out;
}

}  // namespace

Result<ColmapRigs> rigs_of(const ColmapForm& form, const ColmapRigs& source) {
  const Problem& problem = *form.problem;
  RigNames names;
  if (problem.rigs.empty()) {
    if (source.empty() || !are_trivial(source)) return ColmapRigs();
    Rigs rigs = trivial_rigs(form, source, names);
    return Stating(form, std::move(rigs), std::move(names), source).run();
  }
  const SceneMetadata* metadata = problem.metadata.get();
  if (metadata != nullptr) names = {metadata->rig_ids, metadata->frame_ids, metadata->sensor_ids};
  const bool known = names.rigs.size() == problem.rigs.count &&
                     names.frames.size() == problem.rigs.num_frames() &&
                     names.sensors.size() == problem.rigs.num_sensors();
  if (known) return Stating(form, problem.rigs, std::move(names), source).run();
  names = {numbers_from_1(problem.rigs.count), numbers_from_1(problem.rigs.num_frames()), {}};
  return Stating(form, problem.rigs, std::move(names), ColmapRigs()).run();
}

}  // namespace sheaf
