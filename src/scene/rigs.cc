// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rigs.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

bool is_identity(const Pose& pose) {
  const Pose identity;
  return pose.rotation == identity.rotation && pose.translation == identity.translation;
}

bool is_motion(const Pose& pose) {
  double norm2 = 0;
  for (const double q : pose.rotation) norm2 += q * q;
  const auto finite = [](double t) { return std::isfinite(t); };
  return std::abs(norm2 - 1) < 1e-6 &&
         std::all_of(pose.translation.begin(), pose.translation.end(), finite);
}

std::string numbered(const char* what, std::size_t i) {
  return std::string(what) + " " + std::to_string(i);
}

std::optional<std::string> wrong_sensors(const Rigs& rigs) {
  if (rigs.sensor_rig.size() != rigs.num_sensors() ||
      rigs.is_reference.size() != rigs.num_sensors())
    return "rigs: sensor_from_rig, sensor_rig and is_reference disagree in length";
  if (rigs.frame_rig.size() != rigs.num_frames())
    return "rigs: rig_from_world and frame_rig disagree in length";
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s) {
    if (rigs.sensor_rig[s] >= rigs.count)
      return numbered("sensor", s) + " names rig " + std::to_string(rigs.sensor_rig[s]) + " of " +
             std::to_string(rigs.count);
    if (!is_motion(rigs.sensor_from_rig[s]))
      return numbered("sensor", s) + ": sensor_from_rig is no rigid motion";
    if (rigs.is_reference[s] != 0 && !is_identity(rigs.sensor_from_rig[s]))
      return numbered("sensor", s) +
             " is its rig's reference: sensor_from_rig must be the identity";
  }
  for (std::size_t f = 0; f < rigs.num_frames(); ++f) {
    if (rigs.frame_rig[f] >= rigs.count)
      return numbered("frame", f) + " names rig " + std::to_string(rigs.frame_rig[f]) + " of " +
             std::to_string(rigs.count);
    if (!is_motion(rigs.rig_from_world[f]))
      return numbered("frame", f) + ": rig_from_world is no rigid motion";
  }
  return {};
}

}  // namespace

Pose pose_in_rig(const Pose& sensor, const Pose& frame) {
  if (is_identity(sensor)) return frame;
  const RigidMotion<double> image =
      composed<double>({sensor.rotation, sensor.translation}, {frame.rotation, frame.translation});
  return {image.rotation, image.translation};
}

Pose frame_from_image(const Pose& sensor, const Pose& image) {
  if (is_identity(sensor)) return image;
  const Quaternion<double>& q = sensor.rotation;
  const Quaternion<double> back{q[0], -q[1], -q[2], -q[3]};
  Pose out;
  out.rotation = normalized(multiply(back, image.rotation));
  Vector3<double> t;
  for (std::size_t k = 0; k < 3; ++k) t[k] = image.translation[k] - sensor.translation[k];
  out.translation = multiply(matrix_from_quaternion(back), t);
  return out;
}

Pose pose_of(const Problem& problem, std::size_t image) {
  const Rigs& rigs = problem.rigs;
  if (!in_rig(rigs, image)) return problem.poses[image];
  return pose_in_rig(rigs.sensor_from_rig[rigs.image_sensor[image]],
                     rigs.rig_from_world[rigs.image_frame[image]]);
}

void place_images(Problem& problem) {
  if (problem.rigs.empty()) return;
  for (std::size_t i = 0; i < problem.num_images(); ++i) problem.poses[i] = pose_of(problem, i);
}

std::vector<std::uint8_t> trivial_frames(const Rigs& rigs) {
  std::vector<std::uint32_t> images(rigs.num_frames(), 0);
  std::vector<std::uint8_t> trivial(rigs.num_frames(), 1);
  for (std::size_t i = 0; i < rigs.image_frame.size(); ++i) {
    const std::uint32_t frame = rigs.image_frame[i];
    if (frame == Rigs::kNone) continue;
    if (++images[frame] > 1 || rigs.is_reference[rigs.image_sensor[i]] == 0) trivial[frame] = 0;
  }
  return trivial;
}

bool has_rigid_frames(const Rigs& rigs) {
  if (rigs.empty()) return false;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  return std::find(trivial.begin(), trivial.end(), 0) != trivial.end();
}

void follow_images(Problem& problem) {
  Rigs& rigs = problem.rigs;
  if (rigs.empty()) return;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    if (in_rig(rigs, i) && trivial[rigs.image_frame[i]] != 0)
      rigs.rig_from_world[rigs.image_frame[i]] = problem.poses[i];
}

std::optional<std::string> wrong_rigs(const Problem& problem) {
  const Rigs& rigs = problem.rigs;
  if (auto wrong = wrong_sensors(rigs)) return wrong;
  if (rigs.image_sensor.size() != rigs.image_frame.size())
    return "rigs: image_frame and image_sensor disagree in length";
  if (rigs.empty()) return {};
  if (rigs.image_frame.size() != problem.num_images())
    return "rigs: image_frame must be empty or have one entry for each image";
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const std::uint32_t frame = rigs.image_frame[i], sensor = rigs.image_sensor[i];
    if ((frame == Rigs::kNone) != (sensor == Rigs::kNone))
      return numbered("image", i) + " has a frame or a sensor, and not both";
    if (frame == Rigs::kNone) continue;
    if (frame >= rigs.num_frames() || sensor >= rigs.num_sensors())
      return numbered("image", i) + " names a frame or a sensor that there is not";
    if (rigs.frame_rig[frame] != rigs.sensor_rig[sensor])
      return numbered("image", i) + ": its frame is of rig " +
             std::to_string(rigs.frame_rig[frame]) + ", its sensor of rig " +
             std::to_string(rigs.sensor_rig[sensor]);
  }
  return {};
}

}  // namespace sheaf
