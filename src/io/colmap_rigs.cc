// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <charconv>
#include <map>
#include <unordered_map>

#include "io/byte_cursor.h"
#include "io/colmap_parts.h"
#include "io/line_cursor.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kLeastRig = 8, kLeastFrame = 4 + 4 + 7 * 8 + 4;
constexpr std::int32_t kCameraSensor = 0;

bool read_sensor(ByteCursor& in, std::int32_t& type, std::uint32_t& id) {
  return in.read(type) && in.read(id);
}

std::optional<Error> read_rigs_binary(const ColmapFiles& files, ColmapRigs& rigs) {
  ByteCursor in(files.rigs, files.name("rigs"));
  std::uint64_t count;
  if (auto e = in.read_count("rigs", kLeastRig, count)) return e;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string rest = "the rest of rig " + std::to_string(i + 1);
    std::uint32_t id, sensors, sensor = 0;
    std::int32_t type;
    if (!in.read(id)) return in.truncated(rest);
    if (auto e = in.read_count("sensors", 8, sensors)) return e;
    for (std::uint32_t k = 0; k < sensors; ++k) {
      std::uint32_t sensor_id;
      if (!read_sensor(in, type, sensor_id)) return in.truncated(rest);
      if (k == 0) {
        sensor = sensor_id;
        continue;
      }
      std::uint8_t has_pose;
      double number;
      if (!in.read(has_pose)) return in.truncated(rest);
      for (int n = 0; n < (has_pose ? 7 : 0); ++n)
        if (!in.read(number)) return in.truncated(rest);
    }
    rigs.references.push_back({id, sensor});
  }
  return in.check_end();
}

std::optional<Error> read_frames_binary(const ColmapFiles& files, ColmapRigs& rigs) {
  ByteCursor in(files.frames, files.name("frames"));
  std::uint64_t count;
  if (auto e = in.read_count("frames", kLeastFrame, count)) return e;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::string rest = "the rest of frame " + std::to_string(i + 1);
    RigFrame frame;
    std::uint32_t id, data;
    if (!in.read(id) || !in.read(frame.rig)) return in.truncated(rest);
    frame.pose_begin = in.at();
    frame.pose_end = frame.pose_begin + 56;
    double number;
    for (int n = 0; n < 7; ++n)
      if (!in.read(number)) return in.truncated(rest);
    if (auto e = in.read_count("images of a frame", 16, data)) return e;
    for (std::uint32_t k = 0; k < data; ++k) {
      std::int32_t type;
      std::uint32_t sensor;
      std::uint64_t image;
      if (!read_sensor(in, type, sensor) || !in.read(image)) return in.truncated(rest);
      if (type != kCameraSensor) continue;
      if (frame.images.empty()) frame.camera = sensor;
      frame.images.push_back(image);
    }
    rigs.frames.push_back(std::move(frame));
  }
  return in.check_end();
}

std::optional<Error> read_rigs_text(const ColmapFiles& files, ColmapRigs& rigs) {
  LineCursor in(files.rigs, files.name("rigs"));
  while (in.next_record()) {
    std::uint32_t id, sensors, sensor = 0;
    if (!in.read_integer(id)) return in.refuse("the id of a rig");
    if (!in.read_integer(sensors)) return in.refuse("the number of a rig's sensors");
    for (std::uint32_t k = 0; k < sensors; ++k) {
      std::string_view type;
      std::uint32_t sensor_id, has_pose;
      if (!in.read_word(type)) return in.refuse("the type of a sensor");
      if (!in.read_integer(sensor_id)) return in.refuse("the id of a sensor");
      if (k == 0) {
        sensor = sensor_id;
        continue;
      }
      if (!in.read_integer(has_pose) || has_pose > 1)
        return in.refuse("1 or 0: whether the sensor's pose follows");
      double number;
      for (int n = 0; n < (has_pose ? 7 : 0); ++n)
        if (!in.read_real(number)) return in.refuse("a finite number of a sensor's pose");
    }
    rigs.references.push_back({id, sensor});
  }
  return {};
}

std::optional<Error> read_frames_text(const ColmapFiles& files, ColmapRigs& rigs) {
  LineCursor in(files.frames, files.name("frames"));
  while (in.next_record()) {
    RigFrame frame;
    std::uint32_t id, data;
    if (!in.read_integer(id)) return in.refuse("the id of a frame");
    if (!in.read_integer(frame.rig)) return in.refuse("the id of a frame's rig");
    const auto offset = [&] {
      return static_cast<std::uint64_t>(in.rest().data() - files.frames.data());
    };
    frame.pose_begin = in.line_ended() ? 0 : offset();
    double number;
    for (int n = 0; n < 7; ++n)
      if (!in.read_real(number)) return in.refuse("a finite number of a frame's pose");
    frame.pose_end = in.line_ended() ? 0 : offset();
    if (!in.read_integer(data)) return in.refuse("the number of a frame's images");
    for (std::uint32_t k = 0; k < data; ++k) {
      std::string_view type;
      std::uint32_t sensor;
      std::uint64_t image;
      if (!in.read_word(type)) return in.refuse("the type of a sensor");
      if (!in.read_integer(sensor)) return in.refuse("the id of a sensor");
      if (!in.read_integer(image)) return in.refuse("the id of an image");
      if (type != "CAMERA") continue;
      if (frame.images.empty()) frame.camera = sensor;
      frame.images.push_back(image);
    }
    rigs.frames.push_back(std::move(frame));
  }
  return {};
}

/// The seven numbers of a pose as the form states them.
std::string pose_bytes(const Pose& pose, bool text) {
  std::string out;
  const auto put = [&](double x) {
    char buffer[40];
    if (text) {
      out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr) += ' ';
      return;
    }
    const auto word = std::bit_cast<std::uint64_t>(x);
    for (int shift = 0; shift < 64; shift += 8) out += static_cast<char>(word >> shift);
  };
  for (const double x : pose.rotation) put(x);
  for (const double x : pose.translation) put(x);
  return out;
}

}  // namespace

Result<ColmapRigs> parse_rigs(const ColmapFiles& files) {
  ColmapRigs rigs;
  if (!files.rigs.empty())
    if (auto e = files.text ? read_rigs_text(files, rigs) : read_rigs_binary(files, rigs))
      return *e;
  if (!files.frames.empty())
    if (auto e = files.text ? read_frames_text(files, rigs) : read_frames_binary(files, rigs))
      return *e;
  return rigs;
}

std::vector<std::string> notes_on(const ColmapFiles& files) {
  const Result<ColmapRigs> rigs = parse_rigs(files);
  if (!rigs.ok()) return {};
  const auto& frames = rigs.value().frames;
  const auto several = std::count_if(frames.begin(), frames.end(),
                                     [](const RigFrame& frame) { return frame.images.size() > 1; });
  if (several == 0) return {};
  return {std::to_string(several) + " of " + std::to_string(frames.size()) +
          " frames of the rigs have several images: these move one by one, not as a rig, and rigs "
          "and frames are written only where none has moved"};
}

std::optional<std::string> frames_with_poses(const ColmapFiles& files, const Problem& problem) {
  const Result<ColmapRigs> rigs = parse_rigs(files);
  if (!rigs.ok()) return {};
  std::map<std::uint32_t, std::uint32_t> reference;
  for (const auto& [rig, camera] : rigs.value().references) reference[rig] = camera;
  std::unordered_map<std::uint64_t, std::size_t> image_of_id;
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    image_of_id[problem.metadata->image_ids[j]] = j;
  std::string out;
  std::size_t kept = 0;
  for (const RigFrame& frame : rigs.value().frames) {
    const auto image =
        frame.images.size() == 1 ? image_of_id.find(frame.images[0]) : image_of_id.end();
    const auto rig = reference.find(frame.rig);
    if (image == image_of_id.end() || rig == reference.end() || rig->second != frame.camera)
      return {};
    out.append(files.frames, kept, frame.pose_begin - kept);
    out += pose_bytes(problem.poses[image->second], files.text);
    kept = frame.pose_end;
  }
  return out.append(files.frames, kept, std::string::npos);
}

}  // namespace sheaf
