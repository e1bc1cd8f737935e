// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

class Threads;

/// Observations whose point lies behind the camera, or beyond what a wide lens sees, in order: as
/// `evaluate` lists them.
std::vector<std::uint64_t> behind_camera(const Problem& problem, Threads& threads);

}  // namespace sheaf
