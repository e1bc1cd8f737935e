// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap_rigs.h"

#include <cmath>
#include <unordered_map>

#include "io/byte_cursor.h"
#include "io/line_cursor.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kLeastRig = 8, kLeastFrame = 4 + 4 + 7 * 8 + 4;

/// Reads both files of a binary model.
class BinaryRigs {
 public:
  BinaryRigs(const std::string& bytes, const std::string& name) : in_(bytes, name) {}

  std::optional<Error> read_rigs(ColmapRigs& rigs) {
    std::uint64_t count;
    if (auto e = in_.read_count("rigs", kLeastRig, count)) return e;
    for (std::uint64_t i = 0; i < count; ++i) {
      rest_ = "the rest of rig " + std::to_string(i + 1);
      RigRecord& rig = rigs.rigs.emplace_back();
      rig.place = in_.at();
      std::uint32_t sensors;
      if (!in_.read(rig.id)) return in_.truncated(rest_);
      if (auto e = in_.read_count("sensors", 8, sensors)) return e;
      for (std::uint32_t k = 0; k < sensors; ++k)
        if (auto e = read_rig_sensor(k == 0, rig.sensors.emplace_back())) return e;
    }
    return in_.check_end();
  }

  std::optional<Error> read_frames(ColmapRigs& rigs) {
    std::uint64_t count;
    if (auto e = in_.read_count("frames", kLeastFrame, count)) return e;
    for (std::uint64_t i = 0; i < count; ++i) {
      rest_ = "the rest of frame " + std::to_string(i + 1);
      FrameRecord& frame = rigs.frames.emplace_back();
      frame.place = in_.at();
      std::uint32_t data;
      if (!in_.read(frame.id) || !in_.read(frame.rig)) return in_.truncated(rest_);
      if (auto e = read_pose(frame.pose)) return e;
      if (auto e = in_.read_count("images of a frame", 16, data)) return e;
      for (std::uint32_t k = 0; k < data; ++k) {
        FrameDatum& datum = frame.data.emplace_back();
        if (auto e = read_type(datum.type)) return e;
        if (!in_.read(datum.sensor) || !in_.read(datum.id)) return in_.truncated(rest_);
      }
    }
    return in_.check_end();
  }

 private:
  std::optional<Error> read_type(SensorType& type) {
    std::int32_t number;
    if (!in_.read(number)) return in_.truncated(rest_);
    type = static_cast<SensorType>(number);
    if (number >= -1 && number <= 1) return {};
    return in_.refuse("found " + std::to_string(number) +
                      ", expected the type of a sensor, 0 (camera) or 1 (IMU)");
  }

  std::optional<Error> read_pose(std::array<double, 7>& pose) {
    for (double& x : pose) {
      if (!in_.read(x)) return in_.truncated(rest_);
      if (!std::isfinite(x))
        return in_.refuse("found a number that is not finite, expected a pose in " + rest_);
    }
    return {};
  }

  std::optional<Error> read_rig_sensor(bool reference, RigSensor& sensor) {
    if (auto e = read_type(sensor.type)) return e;
    if (!in_.read(sensor.id)) return in_.truncated(rest_);
    if (reference) return {};
    std::uint8_t has_pose;
    if (!in_.read(has_pose)) return in_.truncated(rest_);
    if (has_pose > 1)
      return in_.refuse("found " + std::to_string(has_pose) +
                        ", expected 1 or 0: whether the sensor's pose follows");
    return has_pose ? read_pose(sensor.pose.emplace()) : std::nullopt;
  }

  ByteCursor in_;
  std::string rest_;
};

bool read_type(LineCursor& in, SensorType& type) {
  std::string_view word;
  if (!in.read_word(word)) return false;
  type = word == "CAMERA" ? SensorType::camera
         : word == "IMU"  ? SensorType::imu
                          : SensorType::invalid;
  return type != SensorType::invalid || word == "INVALID";
}

bool read_pose(LineCursor& in, std::array<double, 7>& pose) {
  for (double& x : pose)
    if (!in.read_real(x)) return false;
  return true;
}

std::optional<Error> read_rigs_text(const ColmapFiles& files, ColmapRigs& rigs) {
  LineCursor in(files.rigs, files.name("rigs"));
  while (in.next_record()) {
    RigRecord& rig = rigs.rigs.emplace_back();
    rig.place = in.line_number();
    std::uint32_t sensors;
    if (!in.read_integer(rig.id)) return in.refuse("the id of a rig");
    if (!in.read_integer(sensors)) return in.refuse("the number of a rig's sensors");
    for (std::uint32_t k = 0; k < sensors; ++k) {
      RigSensor& sensor = rig.sensors.emplace_back();
      std::uint32_t has_pose;
      if (!read_type(in, sensor.type)) return in.refuse("the type of a sensor, CAMERA or IMU");
      if (!in.read_integer(sensor.id)) return in.refuse("the id of a sensor");
      if (k == 0) continue;
      if (!in.read_integer(has_pose) || has_pose > 1)
        return in.refuse("1 or 0: whether the sensor's pose follows");
      if (has_pose && !read_pose(in, sensor.pose.emplace()))
        return in.refuse("a finite number of a sensor's pose");
    }
  }
  return {};
}

std::optional<Error> read_frames_text(const ColmapFiles& files, ColmapRigs& rigs) {
  LineCursor in(files.frames, files.name("frames"));
  while (in.next_record()) {
    FrameRecord& frame = rigs.frames.emplace_back();
    frame.place = in.line_number();
    std::uint32_t data;
    if (!in.read_integer(frame.id)) return in.refuse("the id of a frame");
    if (!in.read_integer(frame.rig)) return in.refuse("the id of a frame's rig");
    if (!read_pose(in, frame.pose)) return in.refuse("a finite number of a frame's pose");
    if (!in.read_integer(data)) return in.refuse("the number of a frame's images");
    for (std::uint32_t k = 0; k < data; ++k) {
      FrameDatum& datum = frame.data.emplace_back();
      if (!read_type(in, datum.type)) return in.refuse("the type of a sensor, CAMERA or IMU");
      if (!in.read_integer(datum.sensor)) return in.refuse("the id of a sensor");
      if (!in.read_integer(datum.id)) return in.refuse("the id of an image");
    }
  }
  return {};
}

}  // namespace

Result<ColmapRigs> parse_rigs(const ColmapFiles& files) {
  ColmapRigs rigs;
  if (files.text) {
    if (auto e = read_rigs_text(files, rigs)) return *e;
    if (auto e = read_frames_text(files, rigs)) return *e;
    return rigs;
  }
  if (!files.rigs.empty())
    if (auto e = BinaryRigs(files.rigs, files.name("rigs")).read_rigs(rigs)) return *e;
  if (!files.frames.empty())
    if (auto e = BinaryRigs(files.frames, files.name("frames")).read_frames(rigs)) return *e;
  return rigs;
}

ColmapRigs parse_rigs(const SourceFiles& source) {
  if (!source.format.starts_with("colmap")) return {};
  ColmapFiles files;
  files.text = source.format == "colmap-text";
  files.rigs = source.rigs;
  files.frames = source.frames;
  return parse_rigs(files).value();
}

bool are_trivial(const ColmapRigs& rigs) {
  std::unordered_map<std::uint32_t, FrameDatum> reference;
  for (const RigRecord& rig : rigs.rigs)
    if (!rig.sensors.empty()) reference[rig.id] = {rig.sensors[0].type, rig.sensors[0].id, 0};
  for (const FrameRecord& frame : rigs.frames) {
    std::size_t images = 0;
    for (const FrameDatum& datum : frame.data) {
      if (datum.type != SensorType::camera) continue;
      const auto rig = reference.find(frame.rig);
      if (++images > 1 || rig == reference.end() || rig->second.type != SensorType::camera ||
          rig->second.sensor != datum.sensor)
        return false;
    }
  }
  return true;
}

}  // namespace sheaf
