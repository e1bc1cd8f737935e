// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "scene/portable_rotation.h"
#include "scene/stated_rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// An image's rotation with the same bits on every machine: from what the file stated where that
/// still holds, else as the problem has it.
inline Quaternion<double> portable_rotation(const Problem& problem, std::size_t image) {
  if (const auto stated = stated_rotation(problem, image)) return portable_quaternion(*stated);
  return problem.poses[image].rotation;
}

}  // namespace sheaf
