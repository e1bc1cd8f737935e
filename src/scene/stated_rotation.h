// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// The rotation of an image as its file stated it (angle-axis, radians), where the pose's
/// quaternion is still the one that this converts to, bit for bit.
inline std::optional<Vector3<double>> stated_rotation(const Problem& problem, std::size_t image) {
  if (problem.bal_angle_axis.empty()) return {};
  const double* a = &problem.bal_angle_axis[3 * image];
  const Vector3<double> stated{a[0], a[1], a[2]};
  const Quaternion<double> converted = quaternion_from_angle_axis(stated);
  for (std::size_t k = 0; k < 4; ++k)
    if (std::bit_cast<std::uint64_t>(converted[k]) !=
        std::bit_cast<std::uint64_t>(problem.poses[image].rotation[k]))
      return {};
  return stated;
}

}  // namespace sheaf
