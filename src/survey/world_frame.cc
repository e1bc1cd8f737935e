// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <GeographicLib/LocalCartesian.hpp>

#include "sheaf/survey.h"

namespace sheaf {
namespace {

GeographicLib::LocalCartesian local_cartesian(const std::array<double, 3>& origin) {
  return {origin[0], origin[1], origin[2]};
}

}  // namespace

std::array<double, 3> to_local(const WorldFrame& frame, const std::array<double, 3>& world) {
  if (frame.kind == WorldKind::local) return world;
  const std::array<double, 3>& origin = frame.origin.value();
  if (frame.kind == WorldKind::projected)
    return {world[0] - origin[0], world[1] - origin[1], world[2] - origin[2]};
  std::array<double, 3> out;
  local_cartesian(origin).Forward(world[0], world[1], world[2], out[0], out[1], out[2]);
  return out;
}

std::array<double, 3> to_world(const WorldFrame& frame, const std::array<double, 3>& local) {
  if (frame.kind == WorldKind::local) return local;
  const std::array<double, 3>& origin = frame.origin.value();
  if (frame.kind == WorldKind::projected)
    return {local[0] + origin[0], local[1] + origin[1], local[2] + origin[2]};
  std::array<double, 3> out;
  local_cartesian(origin).Reverse(local[0], local[1], local[2], out[0], out[1], out[2]);
  return out;
}

}  // namespace sheaf
