// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "geometry/rotation.h"
#include "scene/portable_rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Poses of scenes, with the same bits on every machine.

/// Rows are the camera's axes in the world: z along `ahead`, x turned by `roll_rad` from the
/// horizon (the world's z is up).
inline Quaternion<double> looking(const Vector3<double>& ahead, double roll_rad) {
  const auto unit = [](const Vector3<double>& v) {
    const double n = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return Vector3<double>{v[0] / n, v[1] / n, v[2] / n};
  };
  const Vector3<double> z = unit(ahead);
  const Vector3<double> aside =
      std::abs(z[2]) < 0.9 ? Vector3<double>{0, 0, 1} : Vector3<double>{1, 0, 0};
  const Vector3<double> level = unit(cross(z, aside)), down = cross(z, level);
  const SineCosine roll = portable_sine_cosine(roll_rad);
  Vector3<double> x, y;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = roll.cosine * level[i] + roll.sine * down[i];
    y[i] = roll.cosine * down[i] - roll.sine * level[i];
  }
  return portable_quaternion(Matrix3<double>{x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]});
}

/// cam_from_world of a camera whose centre stands there.
inline Pose pose_at(const Quaternion<double>& rotation, const Vector3<double>& centre) {
  const Vector3<double> t = multiply(portable_matrix(rotation), centre);
  return {rotation, {-t[0], -t[1], -t[2]}};
}

}  // namespace sheaf
