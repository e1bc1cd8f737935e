// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/rig_errors.h"

#include <cmath>
#include <cstdint>
#include <optional>

#include "geometry/rotation.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kNone = Rigs::kNone;

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

double length(const Vector3<double>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  return length({a[0] - b[0], a[1] - b[1], a[2] - b[2]});
}

double angle_between(const Quaternion<double>& a, const Quaternion<double>& b) {
  return length(angle_axis_from_quaternion(multiply(a, conjugate(b))));
}

Vector3<double> center_of(const Pose& pose) {
  Vector3<double> c =
      multiply(matrix_from_quaternion(conjugate(pose.rotation)), Vector3<double>(pose.translation));
  for (double& x : c) x = -x;
  return c;
}

/// The estimate's counterparts of the reference's frames and sensors, by their images; kNone for
/// those that have none.
struct Counterparts {
  std::vector<std::uint32_t> frames, sensors;
};

/// False where `of` has another counterpart already.
bool pair(std::vector<std::uint32_t>& counterparts, std::uint32_t of, std::uint32_t with) {
  std::uint32_t& counterpart = counterparts[of];
  if (counterpart == kNone) counterpart = with;
  return counterpart == with;
}

/// Nothing where the two do not group images alike.
std::optional<Counterparts> counterparts_of(const Rigs& reference, const Rigs& estimate) {
  Counterparts out{std::vector<std::uint32_t>(reference.num_frames(), kNone),
                   std::vector<std::uint32_t>(reference.num_sensors(), kNone)};
  Counterparts back{std::vector<std::uint32_t>(estimate.num_frames(), kNone),
                    std::vector<std::uint32_t>(estimate.num_sensors(), kNone)};
  for (std::size_t j = 0; j < reference.image_frame.size(); ++j) {
    if (in_rig(reference, j) != in_rig(estimate, j)) return {};
    if (!in_rig(reference, j)) continue;
    const std::uint32_t frame = reference.image_frame[j], sensor = reference.image_sensor[j];
    const std::uint32_t other = estimate.image_frame[j], its = estimate.image_sensor[j];
    if (!pair(out.frames, frame, other) || !pair(back.frames, other, frame) ||
        !pair(out.sensors, sensor, its) || !pair(back.sensors, its, sensor) ||
        reference.is_reference[sensor] != estimate.is_reference[its])
      return {};
  }
  return out;
}

}  // namespace

RigErrorLists list_rig_errors(const Problem& estimate, const Problem& reference,
                              const Similarity& similarity) {
  const Rigs &have = estimate.rigs, &want = reference.rigs;
  RigErrorLists out;
  if (!has_rigid_frames(have) || !has_rigid_frames(want)) return out;
  const std::optional<Counterparts> counterparts = counterparts_of(want, have);
  if (!counterparts) return out;
  for (std::size_t f = 0; f < want.num_frames(); ++f) {
    if (counterparts->frames[f] == kNone) continue;
    const Pose& frame = have.rig_from_world[counterparts->frames[f]];
    const Quaternion<double> turned = multiply(frame.rotation, conjugate(similarity.rotation));
    out.frame_rotation_rad.push_back(angle_between(turned, want.rig_from_world[f].rotation));
    out.frame_center.push_back(
        distance(similarity(center_of(frame)), center_of(want.rig_from_world[f])));
  }
  for (std::size_t s = 0; s < want.num_sensors(); ++s) {
    if (counterparts->sensors[s] == kNone || want.is_reference[s] != 0) continue;
    const Pose& sensor = have.sensor_from_rig[counterparts->sensors[s]];
    const Vector3<double>& t = sensor.translation;
    const double scale = similarity.scale;
    out.sensor_rotation_rad.push_back(
        angle_between(sensor.rotation, want.sensor_from_rig[s].rotation));
    out.sensor_translation.push_back(
        distance({scale * t[0], scale * t[1], scale * t[2]}, want.sensor_from_rig[s].translation));
  }
  return out;
}

}  // namespace sheaf
