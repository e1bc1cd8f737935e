// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <concepts>

#include "io/colmap_restate.h"
#include "io/colmap_rigs.h"

namespace sheaf {
namespace {

void put(std::string& out, std::unsigned_integral auto word) {
  for (std::size_t shift = 0; shift < 8 * sizeof word; shift += 8)
    out += static_cast<char>(word >> shift);
}
void put(std::string& out, SensorType type) { put(out, static_cast<std::uint32_t>(type)); }
void put(std::string& out, const std::array<double, 7>& pose) {
  for (const double x : pose) put(out, std::bit_cast<std::uint64_t>(x));
}

const char* name_of(SensorType type) {
  return type == SensorType::camera ? "CAMERA " : type == SensorType::imu ? "IMU " : "INVALID ";
}

bool same_bits(const std::array<double, 7>& a, const std::array<double, 7>& b) {
  return std::bit_cast<std::array<std::uint64_t, 7>>(a) ==
         std::bit_cast<std::array<std::uint64_t, 7>>(b);
}

bool same(const RigRecord& a, const RigRecord& b) {
  if (a.sensors.size() != b.sensors.size()) return false;
  for (std::size_t k = 0; k < a.sensors.size(); ++k) {
    const RigSensor &s = a.sensors[k], &t = b.sensors[k];
    if (s.type != t.type || s.id != t.id || s.pose.has_value() != t.pose.has_value() ||
        (s.pose && !same_bits(*s.pose, *t.pose)))
      return false;
  }
  return true;
}

bool same(const FrameRecord& a, const FrameRecord& b) {
  return a.rig == b.rig && a.data == b.data && same_bits(a.pose, b.pose);
}

template <class Record>
std::vector<std::uint32_t> ids_of(const std::vector<Record>& records) {
  std::vector<std::uint32_t> ids;
  for (const Record& record : records) ids.push_back(record.id);
  return ids;
}

void format_rig(const RigRecord& rig, std::string& out) {
  put_field(out, std::uint64_t{rig.id});
  put_field(out, std::uint64_t{rig.sensors.size()});
  for (std::size_t k = 0; k < rig.sensors.size(); ++k) {
    const RigSensor& sensor = rig.sensors[k];
    out += name_of(sensor.type);
    put_field(out, std::uint64_t{sensor.id});
    if (k == 0) continue;
    put_field(out, std::uint64_t{sensor.pose.has_value()});
    if (sensor.pose)
      for (const double x : *sensor.pose) put_field(out, x);
  }
  end_line(out);
}

void format_frame(const FrameRecord& frame, std::string& out) {
  put_field(out, std::uint64_t{frame.id});
  put_field(out, std::uint64_t{frame.rig});
  for (const double x : frame.pose) put_field(out, x);
  put_field(out, std::uint64_t{frame.data.size()});
  for (const FrameDatum& datum : frame.data) {
    out += name_of(datum.type);
    put_field(out, std::uint64_t{datum.sensor});
    put_field(out, datum.id);
  }
  end_line(out);
}

template <class Record>
std::string text_of(const std::vector<Record>& now, const std::string& source,
                    const std::vector<Record>& before, const char* header,
                    void (*format)(const Record&, std::string&)) {
  const RecordLines lines{
      header, now.size(), 1, [&](std::size_t i, int, std::string& out) { format(now[i], out); },
      [&](std::size_t i, std::size_t were, int) { return same(now[i], before[were]); }};
  return source.empty() ? state(lines)
                        : restate(lines, source, numbers_now(ids_of(before), ids_of(now)));
}

}  // namespace

std::string rigs_binary(const ColmapRigs& rigs) {
  std::string out;
  put(out, std::uint64_t{rigs.rigs.size()});
  for (const RigRecord& rig : rigs.rigs) {
    put(out, rig.id);
    put(out, static_cast<std::uint32_t>(rig.sensors.size()));
    for (std::size_t k = 0; k < rig.sensors.size(); ++k) {
      const RigSensor& sensor = rig.sensors[k];
      put(out, sensor.type);
      put(out, sensor.id);
      if (k == 0) continue;
      put(out, static_cast<std::uint8_t>(sensor.pose.has_value()));
      if (sensor.pose) put(out, *sensor.pose);
    }
  }
  return out;
}

std::string frames_binary(const ColmapRigs& rigs) {
  std::string out;
  put(out, std::uint64_t{rigs.frames.size()});
  for (const FrameRecord& frame : rigs.frames) {
    put(out, frame.id);
    put(out, frame.rig);
    put(out, frame.pose);
    put(out, static_cast<std::uint32_t>(frame.data.size()));
    for (const FrameDatum& datum : frame.data) {
      put(out, datum.type);
      put(out, datum.sensor);
      put(out, datum.id);
    }
  }
  return out;
}

std::string rigs_text(const ColmapRigs& rigs, const std::string& source, const ColmapRigs& before) {
  return text_of(rigs.rigs, source, before.rigs,
                 "# id, sensors, type and id of the reference; of each other one: type, id, 1 and "
                 "qw qx qy qz, tx ty tz (sensor from rig), or 0\n",
                 format_rig);
}

std::string frames_text(const ColmapRigs& rigs, const std::string& source,
                        const ColmapRigs& before) {
  return text_of(rigs.frames, source, before.frames,
                 "# id, rig id, qw qx qy qz, tx ty tz (rig from world), measurements: type and id "
                 "of the sensor, id of the image\n",
                 format_frame);
}

}  // namespace sheaf
