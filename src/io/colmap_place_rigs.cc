// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <set>
#include <unordered_map>

#include "io/colmap_draft.h"
#include "io/colmap_rigs.h"
#include "scene/rigs.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

using Place = std::optional<Error>;
constexpr std::uint32_t kNone = Rigs::kNone;

/// Poses of images as stated may differ by this much from what frames and sensors give: radians,
/// and relative to the lengths that are added up.
constexpr double kRounding = 1e-9;

double length(const std::array<double, 3>& t) {
  return std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
}

/// Whether two poses of an image are the same but for rounding; `reach`: of the lengths.
bool close(const Pose& a, const Pose& b, double reach) {
  double dot = 0, off2 = 0, shift2 = 0;
  for (std::size_t k = 0; k < 4; ++k) dot += a.rotation[k] * b.rotation[k];
  for (std::size_t k = 0; k < 4; ++k) {
    const double off = a.rotation[k] - (dot < 0 ? -1 : 1) * b.rotation[k];
    off2 += off * off;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const double shift = a.translation[k] - b.translation[k];
    shift2 += shift * shift;
  }
  return 2 * std::sqrt(off2) <= kRounding && std::sqrt(shift2) <= kRounding * reach;
}

class Placing {
 public:
  Placing(const ColmapFiles& files, const ColmapRigs& records, ColmapDraft& draft)
      : files_(files), records_(records), draft_(draft) {}

  Place run() {
    for (const auto& step : {&Placing::index_images, &Placing::check_rigs, &Placing::find_frames,
                             &Placing::check_images, &Placing::number_rigs, &Placing::add_frames})
      if (Place e = (this->*step)()) return e;
    place_images();
    if (!are_trivial(records_))
      draft_.set_rigs(std::move(rigs_), std::move(rig_ids_), std::move(frame_ids_),
                      std::move(sensor_ids_));
    return {};
  }

 private:
  Error refuse(const char* stem, std::uint64_t place, const std::string& found,
               const std::string& expected) const {
    const std::string at = files_.text ? ":" : ": byte ";
    return Error(ErrorCode::unreadable_input, files_.name(stem) + at + std::to_string(place) +
                                                  ": found " + found + ", expected " + expected);
  }

  Place index_images() {
    const SceneMetadata& metadata = draft_.metadata();
    for (std::uint32_t j = 0; j < metadata.image_ids.size(); ++j)
      image_of_id_[metadata.image_ids[j]] = j;
    for (std::uint32_t c = 0; c < metadata.camera_ids.size(); ++c)
      camera_of_id_[metadata.camera_ids[c]] = c;
    frame_of_image_.assign(metadata.image_ids.size(), kNone);
    sensor_of_image_.assign(metadata.image_ids.size(), kNone);
    return {};
  }

  Place check_rigs() {
    for (std::uint32_t r = 0; r < records_.rigs.size(); ++r) {
      const RigRecord& rig = records_.rigs[r];
      const std::string which = "rig " + std::to_string(rig.id);
      if (!rig_of_id_.emplace(rig.id, r).second)
        return refuse("rigs", rig.place, which + " a second time", "ids that differ");
      std::set<std::pair<SensorType, std::uint32_t>> sensors;
      for (const RigSensor& sensor : rig.sensors) {
        if (!sensors.emplace(sensor.type, sensor.id).second)
          return refuse("rigs", rig.place,
                        "sensor " + std::to_string(sensor.id) + " of " + which + " a second time",
                        "sensors that differ");
        if (sensor.type == SensorType::camera && !camera_of_id_.contains(sensor.id))
          return refuse("rigs", rig.place,
                        "camera id " + std::to_string(sensor.id) + " in " + which,
                        "the id of one of the cameras in " + files_.name("cameras"));
      }
    }
    return {};
  }

  /// The number of a frame's sensor in its rig's record.
  Place find_sensor(const FrameRecord& frame, const FrameDatum& datum, std::uint32_t& number) {
    const RigRecord& rig = records_.rigs[rig_of_id_.at(frame.rig)];
    const std::string image = "image id " + std::to_string(datum.id) + " by camera " +
                              std::to_string(datum.sensor) + " in frame " +
                              std::to_string(frame.id);
    const std::string of_rig = "a sensor of rig " + std::to_string(frame.rig);
    for (number = 0; number < rig.sensors.size(); ++number) {
      const RigSensor& sensor = rig.sensors[number];
      if (sensor.type != SensorType::camera || sensor.id != datum.sensor) continue;
      if (number == 0 || sensor.pose) return {};
      return refuse("frames", frame.place, image,
                    of_rig + " that has a pose in " + files_.name("rigs") +
                        " (without one nothing says where the image was taken)");
    }
    return refuse("frames", frame.place, image, of_rig);
  }

  Place find_frames() {
    std::unordered_map<std::uint32_t, std::uint32_t> frame_of_id;
    const SceneMetadata& metadata = draft_.metadata();
    for (std::uint32_t f = 0; f < records_.frames.size(); ++f) {
      const FrameRecord& frame = records_.frames[f];
      const std::string which = "frame " + std::to_string(frame.id);
      if (!frame_of_id.emplace(frame.id, f).second)
        return refuse("frames", frame.place, which + " a second time", "ids that differ");
      if (!rig_of_id_.contains(frame.rig))
        return refuse("frames", frame.place, "rig id " + std::to_string(frame.rig) + " of " + which,
                      "the id of one of the rigs in " + files_.name("rigs"));
      for (const FrameDatum& datum : frame.data) {
        if (datum.type != SensorType::camera) continue;
        const std::string what = "image id " + std::to_string(datum.id) + " in " + which;
        const auto image = image_of_id_.find(datum.id);
        if (image == image_of_id_.end())
          return refuse("frames", frame.place, what,
                        "the id of an image in " + files_.name("images"));
        const std::uint32_t j = image->second;
        if (frame_of_image_[j] != kNone)
          return refuse("frames", frame.place,
                        what + ", which frame " +
                            std::to_string(records_.frames[frame_of_image_[j]].id) + " has too",
                        "each image in one frame");
        const std::uint32_t camera = metadata.camera_ids[draft_.problem().image_camera[j]];
        if (camera != datum.sensor)
          return refuse("frames", frame.place, what + " by camera " + std::to_string(datum.sensor),
                        "its camera " + std::to_string(camera));
        if (Place e = find_sensor(frame, datum, sensor_of_image_[j])) return e;
        frame_of_image_[j] = f;
      }
    }
    return {};
  }

  Place check_images() {
    for (std::size_t j = 0; j < frame_of_image_.size(); ++j)
      if (frame_of_image_[j] == kNone)
        return Error(ErrorCode::unreadable_input,
                     files_.name("frames") + ": found no frame with image id " +
                         std::to_string(draft_.metadata().image_ids[j]) +
                         ", expected each image of " + files_.name("images") + " in one");
    return {};
  }

  static bool is_turn(const Pose& pose) {
    double norm2 = 0;
    for (const double q : pose.rotation) norm2 += q * q;
    return std::abs(norm2 - 1) < 1e-6;
  }

  /// Rigs that took an image, with their cameras.
  Place number_rigs() {
    std::vector<bool> used(records_.rigs.size(), false);
    for (const std::uint32_t f : frame_of_image_)
      used[rig_of_id_.at(records_.frames[f].rig)] = true;
    rig_number_.assign(records_.rigs.size(), kNone);
    sensor_number_.resize(records_.rigs.size());
    for (std::uint32_t r = 0; r < records_.rigs.size(); ++r) {
      const RigRecord& record = records_.rigs[r];
      sensor_number_[r].assign(record.sensors.size(), kNone);
      if (!used[r]) continue;
      rig_number_[r] = rigs_.count++;
      rig_ids_.push_back(record.id);
      for (std::size_t k = 0; k < record.sensors.size(); ++k) {
        const RigSensor& sensor = record.sensors[k];
        if (sensor.type != SensorType::camera || (k > 0 && !sensor.pose)) continue;
        const Pose pose = k == 0 ? Pose() : pose_from_stated(*sensor.pose);
        if (!is_turn(pose))
          return refuse("rigs", record.place, "a quaternion of no direction or an absurd length",
                        "the rotation of sensor " + std::to_string(sensor.id));
        sensor_number_[r][k] = static_cast<std::uint32_t>(rigs_.num_sensors());
        rigs_.sensor_from_rig.push_back(pose);
        rigs_.sensor_rig.push_back(rig_number_[r]);
        rigs_.is_reference.push_back(k == 0);
        sensor_ids_.push_back(sensor.id);
      }
    }
    return {};
  }

  /// Frames with images, and what these are of.
  Place add_frames() {
    std::vector<std::uint32_t> images(records_.frames.size(), 0);
    for (const std::uint32_t f : frame_of_image_) ++images[f];
    std::vector<std::uint32_t> number(records_.frames.size(), kNone);
    for (std::size_t f = 0; f < images.size(); ++f) {
      if (images[f] == 0) continue;
      const FrameRecord& record = records_.frames[f];
      const Pose pose = pose_from_stated(record.pose);
      if (!is_turn(pose))
        return refuse("frames", record.place, "a quaternion of no direction or an absurd length",
                      "the rotation of frame " + std::to_string(record.id));
      number[f] = static_cast<std::uint32_t>(rigs_.num_frames());
      rigs_.rig_from_world.push_back(pose);
      rigs_.frame_rig.push_back(rig_number_[rig_of_id_.at(record.rig)]);
      frame_ids_.push_back(record.id);
    }
    for (std::size_t j = 0; j < frame_of_image_.size(); ++j) {
      const std::uint32_t f = frame_of_image_[j], k = sensor_of_image_[j];
      rigs_.image_frame.push_back(number[f]);
      rigs_.image_sensor.push_back(sensor_number_[rig_of_id_.at(records_.frames[f].rig)][k]);
    }
    return {};
  }

  void place_images() {
    for (std::uint32_t j = 0; j < frame_of_image_.size(); ++j) {
      const Pose& sensor = rigs_.sensor_from_rig[rigs_.image_sensor[j]];
      const Pose& frame = rigs_.rig_from_world[rigs_.image_frame[j]];
      const Pose stated = draft_.problem().poses[j];
      const Pose pose = pose_in_rig(sensor, frame);
      if (same_bits(stated, pose)) continue;
      const double reach =
          length(sensor.translation) + length(frame.translation) + length(stated.translation);
      draft_.place_image(j, pose, !close(stated, pose, reach));
    }
  }

  const ColmapFiles& files_;
  const ColmapRigs& records_;
  ColmapDraft& draft_;
  std::unordered_map<std::uint64_t, std::uint32_t> image_of_id_;
  std::unordered_map<std::uint32_t, std::uint32_t> camera_of_id_, rig_of_id_;
  std::vector<std::uint32_t> frame_of_image_, sensor_of_image_;  ///< numbers of records
  std::vector<std::uint32_t> rig_number_;  ///< of a record's rig among those with images
  std::vector<std::vector<std::uint32_t>> sensor_number_;  ///< of a record's sensors
  Rigs rigs_;
  std::vector<std::uint32_t> rig_ids_, frame_ids_, sensor_ids_;
};

}  // namespace

std::optional<Error> place_rigs(const ColmapFiles& files, const ColmapRigs& rigs,
                                ColmapDraft& draft) {
  if (rigs.empty()) return {};
  return Placing(files, rigs, draft).run();
}

}  // namespace sheaf
