// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_noise.h"

#include <algorithm>

#include "platform/random.h"
#include "scene/portable_rotation.h"
#include "scene/view.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kSensors = 107;  // a stream of the seed

}  // namespace

void disturb_frame(Pose& frame, const NoiseOptions& o, const Vector3<double>& phi,
                   const Vector3<double>& d) {
  const Quaternion<double> before = frame.rotation;
  Vector3<double>& t = frame.translation;
  if (o.center > 0) {
    const Vector3<double> moved = multiply(portable_matrix(before), d);
    for (std::size_t k = 0; k < 3; ++k) t[k] -= moved[k];
  }
  if (o.rotation_rad == 0) return;
  Quaternion<double> turn = portable_quaternion(phi);
  if (o.protocol == NoiseProtocol::ceres) {
    Vector3<double> w = portable_angle_axis(before);
    for (std::size_t k = 0; k < 3; ++k) w[k] += phi[k];
    turn = multiply(portable_quaternion(w),
                    Quaternion<double>{before[0], -before[1], -before[2], -before[3]});
  }
  // C = -R^T t is held, but by rootba, which holds t.
  if (o.protocol != NoiseProtocol::rootba) t = multiply(portable_matrix(turn), t);
  frame.rotation = normalized(multiply(turn, before));
}

void disturb_sensors(Rigs& rigs, const NoiseOptions& o) {
  if (o.sensor_rotation_rad == 0 && o.sensor_translation == 0) return;
  Random random(o.seed, kSensors);
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s) {
    const Quaternion<double> turn = portable_quaternion(normal3(random, o.sensor_rotation_rad));
    const Vector3<double> moved = normal3(random, o.sensor_translation);
    if (rigs.is_reference[s] != 0) continue;
    Pose& sensor = rigs.sensor_from_rig[s];
    sensor.rotation = normalized(multiply(turn, sensor.rotation));
    sensor.translation = multiply(portable_matrix(turn), sensor.translation);
    for (std::size_t k = 0; k < 3; ++k) sensor.translation[k] += moved[k];
  }
}

bool has_free_sensors(const Rigs& rigs) {
  return std::any_of(rigs.is_reference.begin(), rigs.is_reference.end(),
                     [](std::uint8_t reference) { return reference == 0; });
}

}  // namespace sheaf
